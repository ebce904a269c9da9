//! Networks put together and numbered anew.

use selvedge_yarn_model::{Draft, NONE, Woven, YarnMaterial, YarnNetwork};

fn twill(n: usize) -> YarnNetwork {
    let draft = Draft::named("twill-2-2").expect("built in");
    Woven::new([n, n + 1], [1e-3; 2], YarnMaterial::default())
        .build(&draft)
        .expect("a valid cloth")
}

/// Place, arc length, whether held, and place in the node's stack.
type Stop = ([f64; 3], f64, bool, usize);

/// Points, arcs and materials along every yarn, which no numbering changes.
fn along(network: &YarnNetwork) -> Vec<Vec<Stop>> {
    (0..network.yarns.len() as u32)
        .map(|y| {
            network
                .along(y)
                .map(|s| {
                    let strand = network.strands[s as usize];
                    let layer = s - network.offsets[strand.node as usize];
                    let point = network.points[strand.node as usize];
                    (point, strand.arc, strand.held, layer as usize)
                })
                .collect()
        })
        .collect()
}

#[test]
fn numbering_changes_nothing_else() {
    let network = twill(5);
    let n = network.nodes() as u32;
    // 7 and the number of nodes have no common factor.
    assert_ne!(n % 7, 0);
    let order: Vec<u32> = (0..n).map(|i| (7 * i + 3) % n).collect();
    let renumbered = network.renumbered(&order);
    assert_ne!(network, renumbered);
    assert_eq!(along(&network), along(&renumbered));
    for (c, d) in network.crossings.iter().zip(&renumbered.crossings) {
        let place = |net: &YarnNetwork, s: u32| net.strands[s as usize].arc;
        assert_eq!(place(&network, c.warp), place(&renumbered, d.warp));
        assert_eq!(renumbered.strands[d.weft as usize].node, d.node);
        assert_eq!(order[c.node as usize], d.node);
    }
    let mut back = vec![0; order.len()];
    for (old, new) in order.iter().enumerate() {
        back[*new as usize] = old as u32;
    }
    assert_eq!(renumbered.renumbered(&back), network);
    assert!(renumbered.owners().is_sorted());
}

#[test]
fn appended_networks_stay_apart() {
    let (a, b) = (twill(3), twill(4));
    let mut both = a.clone();
    both.append(&b);
    let (first, second) = (along(&a), along(&b));
    assert_eq!(along(&both), [first, second].concat());
    for (s, strand) in both.strands.iter().enumerate() {
        let here = s >= a.strands.len();
        for link in [strand.prev, strand.next]
            .into_iter()
            .filter(|l| *l != NONE)
        {
            assert_eq!(link as usize >= a.strands.len(), here);
            assert_eq!(both.strands[link as usize].yarn, strand.yarn);
        }
        assert!(both.strands_of(strand.node).contains(&(s as u32)));
    }
    let last = both.crossings.last().expect("crossings");
    assert_eq!(both.contacts[last.node as usize], {
        selvedge_yarn_model::NodeContact::Crossing(both.crossings.len() as u32 - 1)
    });
}
