//! The published tables (Cardaillac and Dansereau, *Learning Underwater Active Perception in Simulation*, Tables II
//! and III), for comparison.

/// A row of the published tables: low turbidity first, then high.
pub struct Published {
    /// The method.
    pub name: &'static str,
    /// Features per view.
    pub features: [f64; 2],
    /// Inliers per pair.
    pub inliers: [f64; 2],
    /// Inliers over features.
    pub ratio: [f64; 2],
    /// Coverage, m².
    pub coverage_m2: [f64; 2],
}

/// All rows.
pub const PUBLISHED: [Published; 5] = [
    Published {
        name: "Proposed",
        features: [22391.0, 9527.0],
        inliers: [9363.0, 2125.0],
        ratio: [0.42, 0.22],
        coverage_m2: [35.9, 16.5],
    },
    Published {
        name: "NIQE",
        features: [20067.0, 12097.0],
        inliers: [5904.0, 2302.0],
        ratio: [0.30, 0.19],
        coverage_m2: [56.3, 13.5],
    },
    Published {
        name: "Gradient",
        features: [22051.0, 11122.0],
        inliers: [6620.0, 1999.0],
        ratio: [0.30, 0.17],
        coverage_m2: [33.1, 16.1],
    },
    Published {
        name: "1m pattern",
        features: [25290.0, 11261.0],
        inliers: [8670.0, 2087.0],
        ratio: [0.34, 0.18],
        coverage_m2: [15.8, 15.8],
    },
    Published {
        name: "2m pattern",
        features: [21362.0, 1079.0],
        inliers: [8594.0, 112.0],
        ratio: [0.40, 0.08],
        coverage_m2: [39.4, 19.7],
    },
];
