//! What `grideye characterize` says of real sessions against numpy, from the definitions.

#![expect(clippy::unwrap_used, reason = "what fails in a helper fails the test")]

use grideye_tests::programs::{grideye, root, run};
use grideye_tests::python;
use serde_json::Value;

fn numbers(list: &Value) -> Vec<f64> {
    list.as_array()
        .unwrap()
        .iter()
        .map(|number| number.as_f64().unwrap())
        .collect()
}

#[test]
fn noise_and_allan_deviation_are_those_of_numpy() {
    for session in [
        "Session2_2021-07-01_RoomB_v2.csv",
        "Session3_2021-07-06_RoomA_v2.csv",
    ] {
        let path = root().join("recordings/linaige").join(session);
        let shown = path.to_str().unwrap();
        let Some(mut peer) = python::peer("characterize.py", &[shown], "noise by numpy") else {
            return;
        };
        let peer = run(&mut peer);
        assert_eq!(peer.code, 0, "{peer:?}");
        let theirs: Value = serde_json::from_str(&peer.stdout).unwrap();
        let ours = run(grideye().args(["characterize", shown, "--json", "-"]));
        let ours: Value = serde_json::from_str(&ours.stdout).unwrap();
        assert_eq!(ours["frames"], theirs["frames"]);

        let (sigma, peers) = (numbers(&ours["noise_sigma_c"]), numbers(&theirs["sigma_c"]));
        let mut ratios: Vec<f64> = sigma
            .iter()
            .zip(&peers)
            .map(|(ours, theirs)| ours / theirs)
            .collect();
        ratios.sort_by(f64::total_cmp);
        println!(
            "{session}: sigma ours over numpy's {:.3}, {:.3} to {:.3}",
            ratios[32], ratios[0], ratios[63]
        );
        assert!((0.96..1.04).contains(&ratios[32]), "{ratios:?}");
        assert!(ratios[0] > 0.85 && ratios[63] < 1.15, "{ratios:?}");

        let (mine, peers) = (
            ours["allan"].as_array().unwrap(),
            theirs["allan"].as_array().unwrap(),
        );
        assert_eq!(mine.len(), peers.len());
        for (mine, peer) in mine.iter().zip(peers) {
            let value = |point: &Value, key: &str| point[key].as_f64().unwrap();
            println!(
                "  tau {:.1} s: common {:.4} {:.4}",
                value(mine, "tau_s"),
                value(mine, "common_c"),
                value(peer, "common_c")
            );
            for (key, slack) in [("tau_s", 0.001), ("common_c", 1e-6)] {
                let ratio = value(mine, key) / value(peer, key);
                assert!(
                    (ratio - 1.0).abs() < slack,
                    "{session} {key}: {mine} {peer}"
                );
            }
        }
        let jump = theirs["jump_s"].as_f64().unwrap();
        let found = &ours["timing"]["listed_jumps"];
        if jump < 0.0 {
            assert!(
                (found[0]["by_s"].as_f64().unwrap() - jump).abs() < 0.5,
                "{found} {jump}"
            );
        } else {
            assert_eq!(found.as_array().unwrap().len(), 0);
        }
    }
}
