//! The values of a texture, as compact as they allow: what is looked up at random should stay in the cache.

/// Linear R, G, B values in [0, 1], row by row from the top.
#[derive(Clone)]
pub struct Texels(Stored);

#[derive(Clone)]
enum Stored {
    /// Codes and the values they stand for: pictures of 8 bits have no more than 256.
    Coded(Vec<[u8; 3]>, Box<[f32; 256]>),
    Plain(Vec<[f32; 3]>),
}

impl Texels {
    /// Number of texels.
    pub fn len(&self) -> usize {
        match &self.0 {
            Stored::Coded(codes, _) => codes.len(),
            Stored::Plain(texels) => texels.len(),
        }
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The texel at `index`, below the number of texels.
    #[inline]
    pub fn get(&self, index: usize) -> [f32; 3] {
        match &self.0 {
            Stored::Coded(codes, values) => codes[index].map(|code| values[usize::from(code)]),
            Stored::Plain(texels) => texels[index],
        }
    }

    /// All texels in their order.
    pub fn iter(&self) -> impl Iterator<Item = [f32; 3]> + '_ {
        (0..self.len()).map(|i| self.get(i))
    }
}

impl From<Vec<[f32; 3]>> for Texels {
    fn from(texels: Vec<[f32; 3]>) -> Self {
        Self(match palette(&texels) {
            Some(values) => {
                let code = |value: f32| values.partition_point(|&v| v < value) as u8;
                let codes = texels.iter().map(|texel| texel.map(code)).collect();
                let mut table = Box::new([0.0; 256]);
                table[..values.len()].copy_from_slice(&values);
                Stored::Coded(codes, table)
            }
            None => Stored::Plain(texels),
        })
    }
}

/// The distinct values in ascending order, if there are at most 256 and all can be ordered.
fn palette(texels: &[[f32; 3]]) -> Option<Vec<f32>> {
    let mut values: Vec<f32> = Vec::new();
    for &value in texels.iter().flatten() {
        let place = values.partition_point(|&v| v < value);
        if values.get(place) == Some(&value) {
            continue;
        }
        if value.is_nan() || values.len() == 256 {
            return None;
        }
        values.insert(place, value);
    }
    Some(values)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texels_come_back_as_they_were_put_in() {
        for distinct in [1_u16, 2, 255, 256, 257, 5000] {
            let values = (0..6000_u16).map(|i| f32::from(i % distinct) / 4999.0);
            let values: Vec<f32> = values.collect();
            let texels: Vec<[f32; 3]> = values.chunks(3).map(|c| [c[2], c[0], c[1]]).collect();
            let stored = Texels::from(texels.clone());
            let is_coded = matches!(stored.0, Stored::Coded(..));
            assert_eq!(is_coded, distinct <= 256, "{distinct}");
            assert_eq!(stored.len(), texels.len());
            assert!(stored.iter().eq(texels), "{distinct}");
        }
    }
}
