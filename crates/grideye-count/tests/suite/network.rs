//! The integers of the network, against those of numpy.

use grideye_count::{Network, WeightsError};

/// Written by `tests/peers/counting`: 64 inputs and 4 scores a line.
const VECTORS: &str = include_str!("../vectors.csv");
const SHIPPED: &[u8] = include_bytes!("../../weights/counter.gec");

#[test]
fn scores_are_the_integers_that_numpy_computed() {
    let network = Network::default();
    let mut lines = 0;
    for line in VECTORS.lines() {
        let all: Vec<i32> = line
            .split(',')
            .map(|number| number.parse().unwrap())
            .collect();
        let (input, scores) = all.split_at(64);
        assert_eq!(
            network.scores(input.try_into().unwrap()),
            scores,
            "line {}",
            lines + 1
        );
        lines += 1;
    }
    assert_eq!(lines, 200);
}

#[test]
fn the_shipped_network_has_at_most_20_000_parameters() {
    let layers = 4;
    assert!(SHIPPED.len() - layers < 20_000);
    assert!(Network::new(SHIPPED).is_ok());
}

#[test]
fn what_is_no_file_of_weights_is_refused() {
    let changed = |at: usize, byte: u8| {
        let mut bytes = SHIPPED.to_vec();
        bytes[at] = byte;
        Network::new(&bytes).err()
    };
    assert_eq!(changed(0, b'X'), Some(WeightsError::NotWeights));
    assert_eq!(changed(4, 0), Some(WeightsError::Widths));
    assert_eq!(changed(5, 65), Some(WeightsError::Widths));
    assert_eq!(changed(7, 5), Some(WeightsError::Widths));
    assert_eq!(changed(8, 25), Some(WeightsError::Shift(25)));
    assert!(matches!(
        changed(6, SHIPPED[6] + 1),
        Some(WeightsError::Length { .. })
    ));
    for length in 0..SHIPPED.len() {
        assert!(Network::new(&SHIPPED[..length]).is_err(), "{length}");
    }
    let longer = [SHIPPED, &[0]].concat();
    let found = SHIPPED.len() + 1;
    assert_eq!(
        Network::new(&longer).err(),
        Some(WeightsError::Length {
            wanted: SHIPPED.len(),
            found
        })
    );
}
