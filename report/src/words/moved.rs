//! How an error moved with what was added to a model.

use super::number::error;

/// Of errors before and after, those of the fitted data and those of data that the model was not fitted to. An effect that acts
/// where the runs start need not lower the error elsewhere.
pub(super) fn moved(with: &str, fit: [f64; 2], unseen: [f64; 2]) -> String {
    let [before, after] = unseen.map(error);
    if unseen[1] < unseen[0] && before != after {
        return format!(
            "With {with} the free-run error falls from {before} to {after}, on data that the model was not fitted to."
        );
    }
    let unseen = if before == after {
        format!("stays at {after}")
    } else {
        format!("goes from {before} to {after}")
    };
    let [before, after] = fit.map(error);
    format!(
        "With {with} the free-run error on the fitted data falls from {before} to {after}; on data that the model was not \
         fitted to it {unseen}."
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An error that does not fall is not said to.
    #[test]
    fn the_error_is_said_to_go_where_it_goes() {
        let fell = moved("it", [0.2, 0.02], [0.3, 0.03]);
        assert!(fell.contains("falls from 30.0 % to 3.00 %"), "{fell}");
        let rose = moved("it", [0.0233, 0.0089], [0.00703, 0.00708]);
        assert!(rose.contains("falls from 2.33 % to 0.89 %"), "{rose}");
        assert!(rose.contains("goes from 0.70 % to 0.71 %"), "{rose}");
        let stayed = moved("it", [0.0233, 0.0089], [0.00703, 0.00702]);
        assert!(stayed.contains("stays at 0.70 %"), "{stayed}");
    }
}
