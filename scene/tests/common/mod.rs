//! What several tests of scenes share.

/// Half a tube in front of a column and half behind it, sewn together.
pub const TUBE: &str = r#"{"pattern": {"panels": {
    "front": {"vertices": [[0, 0], [34, 0], [34, 20], [0, 20]],
        "edges": [{"endpoints": [0, 1]}, {"endpoints": [1, 2]},
                  {"endpoints": [2, 3]}, {"endpoints": [3, 0]}],
        "translation": [-17, 0, 14], "rotation": [0, 0, 0]},
    "back": {"vertices": [[0, 0], [34, 0], [34, 20], [0, 20]],
        "edges": [{"endpoints": [0, 1]}, {"endpoints": [1, 2]},
                  {"endpoints": [2, 3]}, {"endpoints": [3, 0]}],
        "translation": [17, 0, -14], "rotation": [0, 180, 0]}},
    "stitches": [[{"panel": "front", "edge": 3}, {"panel": "back", "edge": 1}],
                 [{"panel": "front", "edge": 1}, {"panel": "back", "edge": 3}]]},
    "properties": {"units_in_meter": 100}}"#;
