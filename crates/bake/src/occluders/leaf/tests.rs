use glam::Quat;

use super::*;
use crate::cells::plan::Builder;

const TOLERANCE: Tolerance = Tolerance {
    plane_m: 1e-6,
    hole_m: 1e-5,
};

/// A tube around a door, a little wider than it.
fn framing(triangles: &[Triangle]) -> Vec<Neighbour<Vec3>> {
    let frame = Frame::of(triangles);
    let corners = || {
        triangles
            .iter()
            .flat_map(|triangle| triangle.corners)
            .map(|corner| frame.place(corner))
    };
    let (min, max) = (
        corners().fold(DVec3::INFINITY, DVec3::min),
        corners().fold(DVec3::NEG_INFINITY, DVec3::max),
    );
    let half = 0.5 * 1.03 * (max - min) + DVec3::Z;
    let at = |sides: [f64; 3]| {
        let place = (0.5 * (min + max) + DVec3::from(sides) * half).as_vec3();
        place.x * frame.axes[0] + place.y * frame.axes[1] + place.z * frame.normal
    };
    let sides = [0, 1].into_iter().flat_map(|axis| [(axis, -1.0), (axis, 1.0)]);
    sides
        .flat_map(|(axis, side)| {
            let [a, b, c, d] = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]].map(|[along, through]| {
                let mut corner = [along, along, through];
                corner[axis] = side;
                at(corner)
            });
            [opaque([a, b, c]), opaque([a, c, d])]
        })
        .collect()
}

fn opaque(corners: [Vec3; 3]) -> Neighbour<Vec3> {
    Neighbour { corners, frames: true }
}

/// The only leaf of a door.
fn only(triangles: &[Triangle]) -> Wall {
    let mut leaves = leaves_of(triangles, &framing(triangles), TOLERANCE);
    assert_eq!(leaves.len(), 1);
    leaves.remove(0)
}

fn is_filled(leaf: &Wall) -> bool {
    [Way::Against, Way::Along]
        .into_iter()
        .all(|way| leaf.is_filled(way, 0.0))
}

/// A door of 1 × 2 m, this thick, turned.
fn door(thick_m: f32, turn: Quat) -> Vec<Triangle> {
    let at = |[u, v, w]: [f32; 3]| Vec3::new(3.0, 0.0, 1.0) + turn * Vec3::new(u, 2.0 * v, (w - 0.5) * thick_m);
    // Each side of a cube by its first axis: two triangles where that is 0, two where it is 1.
    let side = |(axis, end): (usize, f32)| {
        let corner = |v: f32, w: f32| {
            let mut corner = [end; 3];
            corner[(axis + 1) % 3] = v;
            corner[(axis + 2) % 3] = w;
            at(corner)
        };
        let [a, c] = [corner(0.0, 0.0), corner(1.0, 1.0)];
        let [mut b, mut d] = [corner(1.0, 0.0), corner(0.0, 1.0)];
        if end == 0.0 {
            std::mem::swap(&mut b, &mut d);
        }
        [Triangle::between([a, b, c]), Triangle::between([a, c, d])]
    };
    let sides = (0..3).flat_map(|axis| [(axis, 0.0), (axis, 1.0)]);
    sides.flat_map(side).collect()
}

#[test]
fn a_leaf_lies_in_its_door_and_ends_with_it_however_that_is_turned() {
    let level = Quat::from_rotation_x(std::f32::consts::FRAC_PI_2);
    for angle in [0.0, 0.3, 0.61, 1.2, 2.5] {
        for turn in [
            Quat::from_rotation_y(angle),
            Quat::from_rotation_y(angle) * level,
            Quat::from_rotation_z(angle),
        ] {
            for thick_m in [0.0, 0.04] {
                let triangles = door(thick_m, turn);
                let leaf = only(&triangles);
                assert!(is_filled(&leaf), "{turn}: {leaf:?}");
                for axis in leaf.axes {
                    assert!(axis.dot(leaf.normal).abs() < 1e-5, "{turn}: {axis}");
                }
                let corners = triangles.iter().flat_map(|triangle| triangle.corners);
                let off_m = corners.map(|corner| (leaf.normal.dot(corner) - leaf.offset).abs());
                let furthest_m = off_m.fold(0.0, f32::max);
                assert!((furthest_m - 0.5 * thick_m).abs() < 1e-5, "{turn}: {furthest_m}");
                let mut sizes = leaf.lines.each_ref().map(|lines| lines[1] - lines[0]);
                sizes.sort_by(f32::total_cmp);
                assert!((sizes[0] - 1.03).abs() < 1e-4, "{turn}: {sizes:?}");
                assert!((sizes[1] - 2.06).abs() < 1e-4, "{turn}: {sizes:?}");
            }
        }
    }
}

/// A sheet in the plane z = 0.5 around a hole from 0.4 to 0.6 of its edges, seen from its front, with a handle before it.
fn sheet() -> Vec<Triangle> {
    let rectangle = |[left, right]: [f32; 2], [low, high]: [f32; 2], z: f32| {
        let [a, b, c, d] = [[left, low], [right, low], [right, high], [left, high]].map(|[x, y]| Vec3::new(x, y, z));
        [Triangle::between([a, b, c]), Triangle::between([a, c, d])]
    };
    [
        rectangle([0.0, 2.0], [0.0, 0.8], 0.5),
        rectangle([0.0, 2.0], [1.2, 2.0], 0.5),
        rectangle([0.0, 0.8], [0.8, 1.2], 0.5),
        rectangle([1.2, 2.0], [0.8, 1.2], 0.5),
        rectangle([1.8, 1.9], [1.0, 1.1], 0.6),
    ]
    .concat()
}

#[test]
fn a_leaf_hides_where_it_is_opaque_and_from_the_side_of_its_faces() {
    let leaf = only(&sheet());
    assert!(!is_filled(&leaf));
    assert!(
        (leaf.offset - 0.5).abs() < 1e-3,
        "in the sheet, not half way to the handle: {}",
        leaf.offset
    );
    let way = if leaf.normal.z > 0.0 {
        [Way::Against, Way::Along]
    } else {
        [Way::Along, Way::Against]
    };
    let opaque = |way: Way, x: f32, y: f32| leaf.opaque_at(way, leaf.place(Vec3::new(x, y, 0.5)));
    let hides = |x: f32, y: f32| opaque(way[0], x, y);
    assert!(hides(0.3, 0.3) && hides(1.0, 1.5) && hides(0.5, 1.0));
    assert!(hides(-0.029, 1.0) && hides(2.029, 2.029), "the gap around it is closed");
    assert!(!hides(-0.031, 1.0));
    assert!(
        !hides(1.0, 1.0) && !hides(0.81, 0.81) && !hides(1.19, 1.0),
        "its hole is not"
    );
    assert!(!leaf.hides(way[1]), "nor is its back");
}

#[test]
fn a_gap_is_closed_only_where_something_stands_along_all_of_a_side() {
    let triangles = door(0.04, Quat::IDENTITY);
    // From 3 to 4 m along x, from 0 to 2 m up: a floor and a lintel, something on its left, something on its right only half way up.
    let panel = |[left, right]: [f32; 2], [low, high]: [f32; 2]| {
        let [a, b, c, d] = [[left, low], [right, low], [right, high], [left, high]].map(|[x, y]| Vec3::new(x, y, 1.0));
        [opaque([a, b, c]), opaque([a, c, d])]
    };
    let framed = [
        panel([2.0, 5.0], [-1.0, -0.02]),
        panel([2.0, 5.0], [2.03, 3.0]),
        panel([2.0, 2.97], [-1.0, 3.0]),
        panel([4.03, 5.0], [-1.0, 1.0]),
    ];
    let beside = framed.concat();
    let leaf = leaves_of(&triangles, &beside, TOLERANCE).remove(0);
    let hides = |x: f32, y: f32| leaf.opaque_at(Way::Along, leaf.place(Vec3::new(x, y, 1.0)));
    assert!(hides(3.5, 1.0) && hides(2.971, 1.0) && hides(3.5, 2.029) && hides(3.5, -0.019));
    assert!(
        hides(3.99, 0.5) && !hides(4.01, 0.5) && !hides(4.01, 1.5),
        "{:?}",
        leaf.lines
    );
    // Bars let through what is beside the leaf.
    let bars = (0..20).map(|bar| panel([4.01, 4.03], [0.1 * bar as f32, 0.1 * bar as f32 + 0.05]));
    let barred = leaves_of(&triangles, &bars.collect::<Vec<_>>().concat(), TOLERANCE).remove(0);
    assert!(
        !barred.opaque_at(Way::Along, barred.place(Vec3::new(4.01, 1.0, 1.0))),
        "{:?}",
        barred.lines
    );
    let free = leaves_of(&triangles, &[], TOLERANCE).remove(0);
    let sizes = free.lines.each_ref().map(|lines| lines[lines.len() - 1] - lines[0]);
    assert!((sizes[0] * sizes[1] - 2.0).abs() < 1e-4, "{sizes:?}");
}

#[test]
fn a_leaf_grows_up_to_what_its_plane_meets_first_and_no_further() {
    let triangles = door(0.04, Quat::IDENTITY);
    let level = |[left, right]: [f32; 2], y: f32| {
        let [a, b, c, d] = [[left, 0.5], [right, 0.5], [right, 1.5], [left, 1.5]].map(|[x, z]| Vec3::new(x, y, z));
        [[a, b, c], [a, c, d]].map(opaque)
    };
    let grown_mm = |beside: &[[Neighbour<Vec3>; 2]], x: f32| {
        let leaf = leaves_of(&triangles, &beside.concat(), TOLERANCE).remove(0);
        let hides = |down_m: f32| leaf.opaque_at(Way::Along, leaf.place(Vec3::new(x, -down_m, 1.0)));
        (0..70).take_while(|step| hides(0.001 * *step as f32 + 0.0005)).count()
    };
    let thin = level([2.0, 5.0], -0.02);
    let below = level([2.0, 5.0], -0.05);
    assert_eq!(grown_mm(&[thin, below], 3.5), 20);
    // A step of the floor, which the rim follows.
    let steps = [level([2.0, 3.6], -0.01), level([3.6, 5.0], -0.04)];
    assert_eq!(grown_mm(&steps, 3.5), 10);
    assert_eq!(grown_mm(&steps, 3.7), 40);
    let stepped = leaves_of(&triangles, &steps.concat(), TOLERANCE).remove(0);
    assert!(
        !is_filled(&stepped) && stepped.is_filled(Way::Along, 0.06),
        "its rim is no hole"
    );
    // A floor that the door reaches into, or rests on, ends it, whatever is below.
    for y in [0.0, 0.01, 0.2] {
        assert_eq!(grown_mm(&[level([2.0, 5.0], y), below], 3.5), 0, "{y}");
    }
    // A handle through the door does not.
    let handle = level([3.4, 3.43], 0.2);
    assert_eq!(grown_mm(&[handle, thin], 3.415), 20);
    // Glass bounds a gap, and frames none.
    let glass = thin.map(|face| Neighbour { frames: false, ..face });
    assert_eq!(grown_mm(&[glass], 3.5), 0);
    assert_eq!(grown_mm(&[glass, below], 3.5), 20);
    // What stands before the door or behind it bounds no gap in its plane.
    let aside = below.map(|face| opaque(face.corners.map(|corner| corner + 0.53 * Vec3::Z)));
    assert_eq!(grown_mm(&[aside], 3.5), 0);
}

#[test]
fn a_leaf_lies_where_most_of_its_frame_stands() {
    // 4 cm thick around z = 1; a thin wall stands in the front quarter of that.
    let triangles = door(0.04, Quat::IDENTITY);
    let panel = |[left, right]: [f32; 2], [low, high]: [f32; 2]| {
        let [a, b, c, d] = [[left, low], [right, low], [right, high], [left, high]].map(|[x, y]| Vec3::new(x, y, 1.01));
        [[a, b, c], [a, c, d]].map(opaque)
    };
    let wall = [
        panel([2.0, 2.99], [-1.0, 3.0]),
        panel([4.01, 5.0], [-1.0, 3.0]),
        panel([2.99, 4.01], [2.01, 3.0]),
        panel([2.99, 4.01], [-1.0, -0.01]),
    ];
    let leaf = leaves_of(&triangles, &wall.concat(), TOLERANCE).remove(0);
    assert!((leaf.offset.abs() - 1.01).abs() < 1e-5, "{}", leaf.offset);
    let hides = |x: f32, y: f32| leaf.opaque_at(Way::Along, leaf.place(Vec3::new(x, y, 1.01)));
    assert!(is_filled(&leaf) && hides(2.991, 2.009) && hides(4.009, -0.009));
    assert!(!hides(2.989, 1.0) && !hides(3.5, 2.011));
}

#[test]
fn a_hinge_opens_no_gap() {
    let mut triangles = door(0.04, Quat::IDENTITY);
    let hinge = Vec3::new(2.98, 1.0, 1.0);
    triangles.push(Triangle::between([hinge, hinge + 0.1 * Vec3::X, hinge + 0.1 * Vec3::Y]));
    let leaf = only(&triangles);
    assert!(is_filled(&leaf), "{:?}", leaf.lines);
}

/// A door of blocks, each from one corner to another, x along it, y up and z through it.
fn blocks(blocks: &[[[f32; 3]; 2]]) -> Vec<Triangle> {
    let mut builder = Builder::default();
    for [min, max] in blocks {
        builder.block("block", *min, *max);
    }
    let world = World::new(&builder.scene).unwrap();
    let origin = world.origin().as_vec3();
    let placed = |t: &Triangle| Triangle::between(t.corners.map(|corner| corner + origin));
    let objects = 0..blocks.len() as u32;
    objects
        .flat_map(|object| world.triangles_of(object).iter().map(placed).collect::<Vec<_>>())
        .collect()
}

fn hides(leaf: &Wall, x: f32, y: f32) -> bool {
    leaf.opaque_at(Way::Along, leaf.place(Vec3::new(x, y, 0.0)))
}

#[test]
fn a_panel_in_a_frame_is_one_leaf_in_the_depth_of_both() {
    let leaf = only(&blocks(&[
        [[0.0, 0.0, 0.0], [0.12, 2.0, 0.10]],
        [[0.88, 0.0, 0.0], [1.0, 2.0, 0.10]],
        [[0.12, 0.0, 0.0], [0.88, 0.12, 0.10]],
        [[0.12, 1.88, 0.0], [0.88, 2.0, 0.10]],
        [[0.12, 0.12, 0.08], [0.88, 1.88, 0.10]],
    ]));
    assert!(is_filled(&leaf), "{leaf:?}");
    let depth_m = leaf.offset * leaf.normal.z;
    assert!(0.08 < depth_m && depth_m < 0.1, "in the panel: {depth_m}");
}

/// Whatever it is, and however far it reaches in, the leaf is that of the door without it.
#[test]
fn what_reaches_into_a_leaf_takes_nothing_from_it() {
    let leaf = blocks(&[[[0.0, 0.0, -0.03], [1.0, 2.0, 0.03]]]);
    let turned = |turn: Quat, at: Vec3, half: Vec3| -> Vec<Triangle> {
        let block = blocks(&[[(-half).to_array(), half.to_array()]]);
        let placed = |p: Vec3| at + turn * p;
        block.iter().map(|t| Triangle::between(t.corners.map(placed))).collect()
    };
    let aslant = Quat::from_rotation_z(0.7) * Quat::from_rotation_x(0.4);
    // A wall stands behind the middle of the leaf only, and lets it a little room.
    let framed = |x: [f32; 2], y: [f32; 2]| {
        let [a, b, c, d] = [[0, 0], [1, 0], [1, 1], [0, 1]].map(|[i, j]: [usize; 2]| Vec3::new(x[i], y[j], -0.02));
        [opaque([a, b, c]), opaque([a, c, d])]
    };
    let wall = [
        framed([-1.0, -0.01], [-1.0, 3.0]),
        framed([1.01, 2.0], [-1.0, 3.0]),
        framed([-0.01, 1.01], [2.01, 3.0]),
        framed([-0.01, 1.01], [-1.0, -0.01]),
    ]
    .concat();
    let alone = leaves_of(&leaf, &wall, TOLERANCE).remove(0);
    assert!(is_filled(&alone) && hides(&alone, -0.005, 1.0));
    for (what, body) in [
        ("a knob", turned(aslant, Vec3::new(0.9, 1.0, 0.04), Vec3::splat(0.03))),
        (
            "one on the other side",
            turned(aslant, Vec3::new(0.9, 1.0, -0.04), Vec3::splat(0.03)),
        ),
        (
            "one right through",
            turned(aslant, Vec3::new(0.9, 1.0, 0.0), Vec3::splat(0.06)),
        ),
        (
            "a panel",
            turned(Quat::IDENTITY, Vec3::new(0.5, 1.0, 0.03), Vec3::new(0.4, 0.9, 0.01)),
        ),
        (
            "a panel aslant",
            turned(aslant, Vec3::new(0.5, 1.0, 0.03), Vec3::new(0.3, 0.3, 0.01)),
        ),
        (
            "a second layer",
            turned(Quat::IDENTITY, Vec3::new(0.5, 1.0, 0.03), Vec3::new(0.5, 1.0, 0.02)),
        ),
        (
            "a handle at its side",
            turned(Quat::IDENTITY, Vec3::new(1.0, 1.0, 0.02), Vec3::new(0.1, 0.05, 0.02)),
        ),
    ] {
        let leaves = leaves_of(&[leaf.clone(), body].concat(), &wall, TOLERANCE);
        assert!(leaves.contains(&alone), "{what}: {leaves:?}");
    }
}

#[test]
fn panels_that_pass_each_other_are_two_leaves() {
    let triangles = blocks(&[
        [[-1.0, 0.0, 0.0], [0.0, 2.0, 0.04]],
        [[0.0, 0.0, 0.1], [1.0, 2.0, 0.14]],
    ]);
    let leaves = leaves_of(&triangles, &framing(&triangles), TOLERANCE);
    assert_eq!(leaves.len(), 2);
    for leaf in &leaves {
        assert!(is_filled(leaf));
        let depth_m = leaf.offset * leaf.normal.z;
        let first = depth_m < 0.07;
        assert_eq!([hides(leaf, -0.5, 1.0), hides(leaf, 0.5, 1.0)], [first, !first]);
        assert!((depth_m - if first { 0.02 } else { 0.12 }).abs() < 1e-3, "{depth_m}");
    }
}

#[test]
fn slats_hide_no_more_than_what_one_plane_cuts_of_them() {
    // At 45°, one behind the edge of the other, so that nothing shows straight through.
    let turn = Quat::from_rotation_x(std::f32::consts::FRAC_PI_4);
    let slat = |number: u8| -> Vec<Triangle> {
        let slat = blocks(&[[[0.0, -0.05, 0.0], [1.0, 0.05, 0.01]]]);
        let placed = |p: Vec3| turn * p + 0.07 * f32::from(number) * Vec3::Y;
        slat.iter().map(|t| Triangle::between(t.corners.map(placed))).collect()
    };
    let slats: Vec<_> = (0..10).flat_map(slat).collect();
    for leaf in leaves_of(&slats, &framing(&slats), TOLERANCE) {
        let heights = (0..640).map(|step| 0.001 * step as f32);
        let hidden = heights.filter(|y| hides(&leaf, 0.5, *y)).count();
        assert!(hidden < 200, "{hidden} of 640");
    }
}

#[test]
fn a_slit_is_as_wide_as_it_is() {
    let leaf = only(&blocks(&[
        [[-1.0, 0.0, 0.0], [-0.002, 2.0, 0.04]],
        [[0.002, 0.0, 0.0], [1.0, 2.0, 0.04]],
    ]));
    assert!(!is_filled(&leaf));
    assert!(hides(&leaf, -0.0021, 1.0) && hides(&leaf, 0.0021, 1.0));
    assert!(!hides(&leaf, 0.0, 1.0));
}

#[test]
fn glass_beyond_the_edge_is_no_gap() {
    let mut triangles = blocks(&[[[0.0, 0.4, 0.0], [30.0, 6.0, 0.1]]]);
    let mut builder = Builder::default();
    let pane = builder.quad(
        "pane",
        [[0.0, 0.0, 0.05], [30.0, 0.0, 0.05], [30.0, 0.4, 0.05], [0.0, 0.4, 0.05]],
    );
    builder.paint(pane, true, true);
    let world = World::new(&builder.scene).unwrap();
    let origin = world.origin().as_vec3();
    for mut face in world.triangles_of(0).iter().copied() {
        face.corners = face.corners.map(|corner| corner + origin);
        triangles.push(face);
    }
    let leaf = only(&triangles);
    assert!(hides(&leaf, 15.0, 0.5) && hides(&leaf, 15.0, 6.08) && hides(&leaf, -0.44, 1.0));
    assert!(!hides(&leaf, 15.0, 0.3));
}

#[test]
fn a_leaf_of_many_faces_far_from_the_origin_lies_in_its_door() {
    let steps = 120u32;
    let sides = |z: f32, flip: bool| {
        let at =
            move |i: u32, j: u32| Vec3::new(48.0 + i as f32 / steps as f32, 2.0 * j as f32 / steps as f32, 50.0 + z);
        let squares = (0..steps).flat_map(move |i| (0..steps).map(move |j| (i, j)));
        squares.flat_map(move |(i, j)| {
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            let two = if flip {
                [[a, c, b], [a, d, c]]
            } else {
                [[a, b, c], [a, c, d]]
            };
            two.map(Triangle::between)
        })
    };
    let triangles: Vec<_> = sides(0.04, false).chain(sides(0.0, true)).collect();
    let tolerance = Tolerance {
        plane_m: 1e-5,
        hole_m: 1e-4,
    };
    let leaves = leaves_of(&triangles, &framing(&triangles), tolerance);
    let offsets: Vec<_> = leaves.iter().map(|leaf| leaf.offset.abs() - 50.0).collect();
    assert_eq!(leaves.len(), 2, "{offsets:?}");
    assert!(
        offsets.iter().all(|off| off.abs() < 1e-4 || (off - 0.04).abs() < 1e-4),
        "{offsets:?}"
    );
    assert!(
        [Way::Against, Way::Along]
            .into_iter()
            .all(|way| leaves.iter().any(|leaf| leaf.is_filled(way, 0.0)))
    );
}
