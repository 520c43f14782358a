//! Measurements of other renderers, from a CSV file.

use std::path::{Path, PathBuf};

use serde::Deserialize;

/// One measurement of another renderer on a scene of the benchmark.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct PeerPoint {
    /// Name and version of the renderer.
    pub renderer: String,
    /// Name of the scene: the stem of the scene file.
    pub scene: String,
    /// Samples per pixel.
    pub spp: u32,
    /// Rendering without start-up, s of processor time.
    pub cpu_s: f64,
    /// Relative mean squared error.
    pub rel_mse: f64,
}

/// A file of peers that cannot be used.
#[derive(Debug, thiserror::Error)]
#[error("{}: {reason}; the columns must be renderer,scene,spp,cpu_s,rel_mse", path.display())]
pub struct PeersError {
    /// The file.
    pub path: PathBuf,
    /// What is wrong, with the line where it is known.
    pub reason: String,
}

/// Reads a CSV file with the columns `renderer,scene,spp,cpu_s,rel_mse`; lines that start with `#` are comments.
///
/// # Errors
/// A file that cannot be read, a missing column, or a number that is not finite and > 0.
pub fn read(path: &Path) -> Result<Vec<PeerPoint>, PeersError> {
    let refuse = |reason: String| PeersError {
        path: path.to_path_buf(),
        reason,
    };
    let mut reader = csv::ReaderBuilder::new()
        .comment(Some(b'#'))
        .trim(csv::Trim::All)
        .from_path(path)
        .map_err(|error| refuse(error.to_string()))?;
    let mut points = Vec::new();
    for row in reader.deserialize() {
        let point: PeerPoint = row.map_err(|error| refuse(error.to_string()))?;
        for (column, value) in [("cpu_s", point.cpu_s), ("rel_mse", point.rel_mse)] {
            if !(value > 0.0 && value.is_finite()) {
                let (renderer, scene, spp) = (&point.renderer, &point.scene, point.spp);
                return Err(refuse(format!(
                    "{column} of {renderer} on {scene} at {spp} spp must be a finite number > 0, got {value}"
                )));
            }
        }
        points.push(point);
    }
    Ok(points)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read_text(text: &str) -> Result<Vec<PeerPoint>, String> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("peers.csv");
        std::fs::write(&path, text).unwrap();
        read(&path).map_err(|error| error.to_string())
    }

    #[test]
    fn columns_go_by_name_and_comments_are_passed_over() {
        let points =
            read_text("# by hand\nscene, spp,rel_mse,renderer,cpu_s\ns1,16,0.9,Mitsuba 3.9,1.0\n");
        let expected = PeerPoint {
            renderer: "Mitsuba 3.9".to_owned(),
            scene: "s1".to_owned(),
            spp: 16,
            cpu_s: 1.0,
            rel_mse: 0.9,
        };
        assert_eq!(points, Ok(vec![expected]));
    }

    #[test]
    fn what_cannot_be_drawn_is_refused_by_name() {
        for (text, words) in [
            (
                "renderer,scene,spp,cpu_s\nm,s1,16,1\n",
                "missing field `rel_mse`",
            ),
            ("renderer,scene,spp,cpu_s,rel_mse\nm,s1,16,x,1\n", "line: 2"),
            (
                "renderer,scene,spp,cpu_s,rel_mse\nm,s1,16,0,1\n",
                "cpu_s of m on s1 at 16 spp must be a finite number > 0, got 0",
            ),
            (
                "renderer,scene,spp,cpu_s,rel_mse\nm,s1,16,1,NaN\n",
                "got NaN",
            ),
        ] {
            let message = read_text(text).unwrap_err();
            assert!(
                message.contains("peers.csv: ") && message.contains(words),
                "{message}"
            );
        }
        let missing = read(Path::new("no/such/peers.csv"))
            .unwrap_err()
            .to_string();
        assert!(missing.contains("no/such/peers.csv"), "{missing}");
    }
}
