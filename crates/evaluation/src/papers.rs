//! What did the papers measure? Their numbers, each stated once, with the place where it stands.

/// Schmalstieg, *The Remote Rendering Pipeline* (1997).
pub mod schmalstieg {
    /// Where the numbers of table 2 stand.
    pub const TABLE_2: &str = "Schmalstieg 1997, *The Remote Rendering Pipeline*, §5.7, table 2";
    /// Levels of an object, and the share of all bytes that is sent, in %.
    pub const LOAD: [(usize, f64); 6] = [(3, 53.8), (4, 48.3), (6, 39.6), (8, 36.8), (10, 34.4), (20, 27.6)];
    /// Frames of the walk, and those that figure 20 shows.
    pub const FRAMES: usize = 500;
    /// The same for figure 20.
    pub const FRAMES_SHOWN: usize = 100;
    /// Levels of the objects of figure 20.
    pub const LEVELS_SHOWN: usize = 6;

    /// Where the numbers of tables 3 and 4 stand.
    pub const TABLE_3: &str = "Schmalstieg 1997, §6.6, table 3, “Enterprise”";
    /// … and those of table 4.
    pub const TABLE_4: &str = "Schmalstieg 1997, §6.6, table 4, “Galleon”";
    /// A level: triangles, lines, range.
    pub type Level = (u64, Option<u64>, u64);
    /// Table 3, finest first; it has no column of lines.
    pub const ENTERPRISE: [Level; 10] = [
        (6343, None, 36),
        (5020, None, 42),
        (3999, None, 52),
        (3182, None, 72),
        (1960, None, 112),
        (1083, None, 193),
        (553, None, 355),
        (167, None, 679),
        (51, None, 1325),
        (16, None, 2615),
    ];
    /// Table 4, finest first.
    pub const GALLEON: [Level; 8] = [
        (4698, Some(0), 1962),
        (4142, Some(0), 2664),
        (3686, Some(0), 4070),
        (2981, Some(9), 6882),
        (1478, Some(8), 12_505),
        (1478, Some(8), 12_505),
        (108, Some(4), 46_122),
        (24, Some(0), 90_932),
    ];
    /// Seconds on an SGI Indy R4400/150.
    pub const ENTERPRISE_S: f64 = 5.4;
    /// The same for the other one.
    pub const GALLEON_S: f64 = 7.8;

    /// Where the numbers of table 7 stand.
    pub const TABLE_7: &str = "Schmalstieg 1997, §7.7, table 7";
    /// A model of table 7: name, vertices, triangles, object size, LOD size, smooth LOD size, all sizes in bytes.
    pub type Model = (&'static str, u64, u64, u64, u64, u64);
    /// Table 7.
    pub const MODELS: [Model; 9] = [
        ("lamp", 584, 1352, 13_968, 17_712, 6_106),
        ("tree", 718, 1092, 15_168, 20_460, 7_288),
        ("shelf", 1239, 2600, 30_228, 37_188, 12_635),
        ("plant", 8228, 13_576, 179_352, 200_154, 89_921),
        ("stool", 1024, 1600, 21_864, 30_528, 8_406),
        ("tub", 3422, 5404, 73_488, 84_906, 26_993),
        ("sink", 2952, 4464, 62_208, 81_558, 23_743),
        ("ball", 1232, 2288, 28_512, 39_420, 14_099),
        ("curtain", 4648, 8606, 107_412, 109_770, 44_334),
    ];
    /// Levels of the conventional models of table 7, the source included.
    pub const LEVELS_OF_TABLE_7: usize = 5;

    /// Where figures 35 and 36 stand.
    pub const FIGURES_35_36: &str = "Schmalstieg 1997, §7.7, figs 35, 36";

    /// Where the sizes of rules stand.
    pub const RULES: &str = "Schmalstieg 1997, §8.6";
    /// Rules: name, their bytes, bytes of the geometry.
    pub const GROWN: [(&str, u64, u64); 3] = [
        ("tree", 7_556, 74_076),
        ("conifer", 7_418, 442_708),
        ("terrain", 3_832, 4 << 20),
    ];
    /// What the tree and the conifer consist of: cones and cylinders of 7 floats each, strips of 6 vertices of 3 floats.
    pub const SHAPES: [(&str, u64, u64); 2] = [("tree", 16_884 + 13_776, 603), ("conifer", 211 + 15_600, 0)];
}

/// Cohen-Or & Zadicario, *Visibility streaming for network-based walkthroughs* (1998).
pub mod cohen_or {
    /// Where the numbers of table 1 stand.
    pub const TABLE_1: &str =
        "Cohen-Or & Zadicario 1998, *Visibility streaming for network-based walkthroughs*, table 1";
    /// A city: polygons, those that are hidden, boxes, those that are hidden, those that the first occluder hides.
    #[derive(Debug, Clone, Copy)]
    pub struct City {
        /// Its name.
        pub name: &'static str,
        /// Polygons.
        pub polygons: u64,
        /// Occluded polygons.
        pub hidden_polygons: u64,
        /// Bounding boxes.
        pub boxes: u64,
        /// Occluded boxes.
        pub hidden_boxes: u64,
        /// First occluders.
        pub first: u64,
    }
    /// Table 1.
    pub const CITIES: [City; 2] = [
        City {
            name: "city 1, dense",
            polygons: 21_280,
            hidden_polygons: 20_062,
            boxes: 2128,
            hidden_boxes: 1954,
            first: 1427,
        },
        City {
            name: "city 2, sparse",
            polygons: 21_280,
            hidden_polygons: 18_713,
            boxes: 2128,
            hidden_boxes: 1755,
            first: 1225,
        },
    ];

    /// Where the numbers of table 2 stand.
    pub const TABLE_2: &str = "Cohen-Or & Zadicario 1998, table 2, city 1";
    /// A column of table 2: its name, total time in ms, intersections of rays and boxes, of rays and polygons.
    pub type Column = (&'static str, u64, u64, u64);
    /// Table 2.
    pub const ACCELERATIONS: [Column; 5] = [
        ("no optimisation", 30_170, 0, 517_800),
        ("bounding box", 8_900, 135_278, 38_648),
        ("redundant occluders", 8_850, 135_089, 38_648),
        ("redundant rays", 7_040, 45_570, 38_648),
        ("fully optimised", 7_030, 42_414, 38_648),
    ];
}

/// Marvie & Bouatouch, *A VRML97-X3D extension for massive scenery management in virtual worlds* (2004).
pub mod marvie {
    /// Where the numbers of table 1 stand.
    pub const TABLE_1: &str =
        "Marvie & Bouatouch 2004, *A VRML97-X3D extension for massive scenery management*, §7.1, table 1";
    /// A model of table 1.
    #[derive(Debug, Clone, Copy)]
    pub struct Model {
        /// Its name.
        pub name: &'static str,
        /// Polygons (fig 7).
        pub polygons: u64,
        /// Seconds that the original file takes.
        pub original_s: f64,
        /// Seconds until what the first cell sees is there.
        pub convergence_s: f64,
        /// Least and mean quality without prefetching, in %.
        pub without: [f64; 2],
        /// The same with it.
        pub with: [f64; 2],
    }
    /// Table 1; the museum's mean with prefetching stands there as “> 99.9 %”.
    pub const MODELS: [Model; 3] = [
        Model {
            name: "museum",
            polygons: 17_000,
            original_s: 9.0,
            convergence_s: 14.0,
            without: [74.0, 98.6],
            with: [96.0, 99.9],
        },
        Model {
            name: "temple",
            polygons: 75_000,
            original_s: 57.0,
            convergence_s: 26.9,
            without: [36.0, 78.6],
            with: [72.0, 94.1],
        },
        Model {
            name: "Kerlan university",
            polygons: 370_000,
            original_s: 330.0,
            convergence_s: 45.5,
            without: [38.0, 80.0],
            with: [61.0, 89.8],
        },
    ];
    /// The line of table 1, bits a second, and the speed, km/h.
    pub const INDOORS: (f64, f64) = (128e3, 3.0);

    /// Where figure 9 stands.
    pub const FIGURE_9: &str = "Marvie & Bouatouch 2004, §7.2, fig 9";
    /// The line of figure 9, bits a second, and the speed, km/h.
    pub const TOWN: (f64, f64) = (56e3, 15.0);
    /// The town's edge in metres, and its polygons (fig 8).
    pub const TOWN_SIZE: (f64, u64) = (700.0, 1_000_000);
    /// Bytes of its rules, compressed, and of its geometry.
    pub const TOWN_BYTES: (f64, f64) = (541.9e3, 1.09e9);
}

/// Sudarsky & Gotsman, *Output-sensitive rendering and communication in dynamic virtual environments* (1997).
pub mod sudarsky {
    /// Where figure 5 stands.
    pub const FIGURE_5: &str = "Sudarsky & Gotsman 1997, *Output-sensitive rendering and communication in dynamic virtual environments*, fig 5";
    /// What the text says of the curve with volumes …
    pub const WITH_VOLUMES: &str = "“almost constant”";
    /// … and of those without.
    pub const WITHOUT: &str = "“linearly proportional”";
}

/// The poster on crowds with partial visibility.
pub mod crowd {
    /// Where figure 1 stands.
    pub const FIGURE_1: &str = "poster on crowds with partial visibility, fig 1";
    /// What the text says of the upper curve …
    pub const WITH_VALUES: &str = "nearly flat";
    /// … and of the lower one.
    pub const WITHOUT: &str = "“scales with scene complexity”";
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_papers_own_shares_follow_from_their_sizes() {
        // Columns "% of obj. size" and "% of LOD size" of table 7.
        let printed = [
            (43.7, 34.5),
            (48.0, 35.6),
            (41.8, 34.0),
            (50.1, 44.9),
            (38.4, 27.5),
            (36.7, 31.8),
            (38.2, 29.1),
            (49.4, 35.8),
            (41.3, 40.4),
        ];
        for ((name, _, _, object, levels, smooth), (of_object, of_levels)) in schmalstieg::MODELS.iter().zip(printed) {
            let share = |whole: &u64| 100.0 * *smooth as f64 / *whole as f64;
            assert!((share(object) - of_object).abs() < 0.1, "{name}");
            assert!((share(levels) - of_levels).abs() < 0.1, "{name}");
        }
        // Each level of table 7's conventional models reuses the vertices, so only triangles are added.
        for (name, _, _, object, levels, _) in schmalstieg::MODELS {
            assert_eq!((levels - object) % 6, 0, "{name}");
        }
        let conifer = schmalstieg::SHAPES[1];
        assert_eq!(conifer.1 * 28, schmalstieg::GROWN[1].2);
    }

    #[test]
    fn columns_of_a_paper_agree_with_its_text() {
        let [none, .., all] = cohen_or::ACCELERATIONS;
        let saved = 100.0 * (1.0 - all.1 as f64 / none.1 as f64);
        assert!((saved - 76.0).abs() < 1.0, "“reduces the total time by 76 %”");
        // Nine seconds at 128 kb/s are what the museum's file takes.
        let bytes = marvie::MODELS[0].original_s * marvie::INDOORS.0 / 8.0;
        assert!((bytes - 144e3).abs() < 1.0);
    }
}
