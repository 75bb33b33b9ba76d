//! Does it matter whether something is done at one go? Every text gives the same bits, takes the same and says the same when
//! its nodes are visited one by one.

use super::{Evaluator, MOST_WORK};
use crate::procedural::{Grown, Limits, NoImports, Program, Settings};

/// Each has something in it that is done at one go, or that could be but for one thing.
const TEXTS: [&str; 42] = [
    "for i in 5 move(2e8 * i, 0, 0) move(2e8 * i, 0, 0) box(1, 1, 1)",
    "scale(1e5) turn(45) scale(14000) turn(-45) box(1, 1, 1)",
    "scale(1e5) turn(45) scale(14000) if 1 turn(-45) box(1, 1, 1)",
    "rule leaf(size, w = 0.3 * size + random()) {
       let h = size * random(1, 2)
       mesh([[0, 0, 0], [w, h, 0], [0, size, h], [-w, 0.5 * h, 0]], [[0, 1, 2], [0, 2, 3], [0, 1, 2, 3]]) box(w, h, size) }
     for i in 27 move(random(-1, 1), i, -random() / 2) turn(i * 137.5) tilt(random(5, 90)) roll(-i) leaf(0.5 + i / 10)",
    "function f(x, y = random()) = x * y + g(x) / 2 + level
     function g(x) = noise(x, 2) + fractal(x, 1, 4) - fractal(x / 9, 1, 9) + random(0, x)
     heights x, z in 50 by 4 steps 29 by 7 = f(x + level, z) + f(z) + mix(x, z, 0.3)",
    "rule high() { heights x, z in 9 by 9 steps 9 by 3 = 1 / (x - 4.5 + z * 0) } high()",
    "rule spike(l, k) { mesh([[0.1, 0, 0], [0, 0.1, 0], [l * (k == 0), l * (k == 1), l * (k == 2)]], [[0, 1, 2]]) }
     part star(k, d) { box(1, 1, 1) for j in 4 for t in 4 for i in 4 move(0, 0.5, 0) turn(t * 90) roll(j * 90) spike((1 + i / 9) * d, k) }
     for d in [-1, 1] for k in 3 star(k, d)",
    "let k = [1, 2] for i in 5 box(k[0], i, 1)",
    "for i in 20 box(1, 9 - i, 1)",
    "for i in 20 move(i, 0, 0) sphere(1, sides = i * 10)",
    "for a, b in [[1, 2], [3, 4], [5, 6], [2, 7], 8] scale(a, b, 1) roll(b) sphere(a / b, sides = 5)",
    "for a in [1, 2, 3, [4], 5] cone(a, 1, top = a / 2)",
    "for a in [[1, 2], [3, 4]] box(count(a), 1, 1)",
    "material m { colour = #fff } material bad { colour = 7 }
     rule r(a) { paint m { cylinder(a, 1) cone(a, 2, closed = 0) } if a > 1 paint bad box(1, 1, 1) } for i in 3 r(i)",
    "material m { colour = #fff } for i in 12 { box(1, 1, 1) paint m { box(1, 2, i) } cone(1, 1, sides = 5) }",
    "scale(1e8) turn(30) scale(10) turn(45) { box(1, 1, 1) scale(3) box(1, 1, 1) }",
    "for i in 9 scale(i - 4) box(1, 1, 1)",
    "for i in 9 scale(-1, 1, i + 1) turn(i) { box(1, 1, 1) sphere(i / 9) }",
    "for i in 9 move(power(10, i + 1), 0, 0) turn(1) box(1, 1, 1)",
    "for i in 9 polygon([[0, 0, 0], [1, 0, 0], [1, 0, i - 4.5], [0, 0, 1]])",
    "for i in 9 polygon([[0, 0, 0], [2, 0, 0], [0.1 + i / 9, 0, 0.1 + i / 9], [0, 0, 2]])",
    "for i in 9 { prism([[0, 0], [0, 1 + i], [1 + i, 1]], i) lathe([[0, 0], [1, i / 2], [i, 3]], sides = 3 + i, smooth = 1) }",
    "for i in 4 lathe([[1, 0], [2 - i, 1]], smooth = i / 4)",
    "rule r(a) { box(a, 1, 1) } r(2) r([1])",
    "rule r(a) { box(a, 1, 1) } for i in 5 { r(i) r(a = i / (i - 3)) }",
    "for i in 9 box(1, 1 / (1e308 * (i * 10)), 1)",
    "for i in 9 box(max(1, 0 - 1e308 * 10 * i), 1, 1)",
    "for i in 9 { let a = 1e308 * (i + 1) box(1, 1, 1) }",
    "for i in 9 box(abs(-i) + sqrt(5 - i), clamp(i, 1, 3) + mod(i, 2), round(i / 2) + ceil(i / 3) + (not i) + (i < 4) + min(i, 2))",
    "for i in 9 box(power(2, i - 0.5 * (i > 6)), sin(i * 30) + 1 + cos(-i * 1e9), 1 + atan2(i, -1) / 400)",
    "for i in 9 box(noise(i * 2e8, 0) + 1, fractal(0.1, 3e8 * (i - 1), 3) + 2, 1)",
    "rule r(n) { box(1, level + 1, n + detail) } for i in 3 r(i) rule s(n) { if n > 0 s(n - 1) r(n) } s(3)",
    "rule a(n) { box(n, 1, 1) b(n + 1) } rule b(n) { move(1, n, 0) c(n * 2) } rule c(n) { sphere(n) box(random(), n, g(n)) }
     function g(n) = h(n) * random() function h(n, k = n * level + random()) = n + k\nfor i in 7 a(i)",
    "part p(n) { for i in 3 move(i, n, 0) box(1, random(), n) } for i in 3 p(i) let w = 3 for i in w box(w, i, 1)",
    "rule b(l, r = l / 9 + random()) levels 4 { box(r, l, level + 1)
       move(0, l, 0) tilt(random(-9, 9)) roll(random(-9, 9)) b(l * 0.7)
       for i in 3 move(0, l * (0.5 + i / 5), 0) turn(i * 120 + random(0, 9)) tilt(40) b(l * random(0.6, 0.8), r * random()) }
     then sphere(l, sides = 5) move(1, 2, 3) b(2)",
    "rule b(l) levels 3 { if l > 0.3 cone(l, 1, sides = 3) for i in 9 scale(0.5) turn(i * 40) b(l - 0.2 * random()) } for i in 2 move(i, 0, 0) b(1)",
    "rule b(l) levels 3 { box(l, l, l) for i in 4 move(l, 0, 0) b(1 / (i - 2 + 2 * (level < 1))) } move(1, 0, 0) b(1)",
    "part p(n) { box(n, 1, random()) for i in 3 move(i, n, 0) p2(n + i) } part p2(n) { sphere(n + 1, sides = 4) } for i in 30 move(i, 0, 0) turn(i) p(mod(i, 4))",
    "part p(n, m = 1 / (n - 3)) { box(n, 1, 1) } for i in 9 move(i, 0, 0) p(i)",
    "material m { colour = #fff } rule b(l) levels 2 { paint m { move(l, 0, 0) b(l + 1) } paint m move(0, l, 0) { b(l) } box(l, 1, 1) } then sphere(1, sides = 4) turn(9) b(1)",
    "rule b(l) levels 2 { let k = l * 2 move(l, 0, 0) { let n = k + 1 turn(n) b(n) } box(k, 1, 1) } then box(1, 1, l) for i in 5 move(9 * i, 1e9 * (i > 3), 1) b(i)",
    "rule b(l) levels 2 { for v, w in [[1, 2], [3, 4], [5, 0.5]] { move(v, w, 0) b(v / w) } for v in [1, 2, [3]] move(v, 0, 0) b(l) } then box(l, 1, 1) move(1, 1, 1) b(1)",
];

#[derive(Clone, Copy)]
enum Way {
    OneByOne,
    AtOneGo,
    /// With the plans of what grew before.
    Again,
}

/// What grew, with every bit of its numbers, or what was said.
fn told(program: &Program, settings: &Settings, measuring: bool, way: Way) -> String {
    let mut evaluator = Evaluator::new(program, settings, &|_| None, measuring);
    match way {
        Way::OneByOne => evaluator.plans.work = MOST_WORK,
        Way::AtOneGo => {}
        Way::Again => evaluator.plans = program.kept.take().filter(|_| !measuring).unwrap_or(evaluator.plans),
    }
    match evaluator.finish(Evaluator::grow_model) {
        // Written out, −0 is another number than 0, and equal digits mean equal bits.
        Ok(Grown {
            parts,
            materials,
            usage,
        }) => format!("{usage:?} {materials:?} {parts:?}"),
        Err(error) => error.to_string(),
    }
}

fn assert_same(text: &str, limits: Limits, ways: &[(u32, u32, bool)]) {
    let program = Program::read("test.dcg", text.to_owned(), &NoImports).unwrap();
    for &(detail, seed, measuring) in ways {
        let settings = Settings {
            seed,
            detail,
            limits: limits.clone(),
            ..Settings::default()
        };
        let ways = [Way::OneByOne, Way::AtOneGo, Way::Again];
        let [one_by_one, at_one_go, again] = ways.map(|way| told(&program, &settings, measuring, way));
        for other in [at_one_go, again] {
            assert!(
                one_by_one == other,
                "{text}\n{settings:?}\n{one_by_one:.300}\n{other:.300}"
            );
        }
    }
}

#[test]
fn it_does_not_matter_how_it_is_done() {
    for text in TEXTS {
        assert_same(text, Limits::default(), &[(4, 0, false), (1, 77, false), (4, 3, true)]);
    }
}

#[test]
fn limits_end_it_where_they_end_its_nodes() {
    let most = |most: u32| {
        let mut limits = [(); 4].map(|()| Limits::default());
        limits[0].steps = u64::from(most * most / 2);
        limits[1].triangles = 16 * u64::from(most);
        limits[2].levels = most;
        limits[3].nesting = most;
        limits
    };
    for text in TEXTS {
        for limits in (0..24).flat_map(most) {
            assert_same(text, limits, &[(3, 5, false)]);
        }
    }
}

#[test]
fn what_calls_itself_without_end_is_not_read_without_end() {
    let twice = |i: u32| format!("function f{i}(x) = f{0}(x) + f{0}(x)\n", i + 1);
    let twice: String = (0..60).map(twice).collect();
    let text = format!("{twice}function f60(x) = x\nfor i in 9 box(f0(i), 1, 1)");
    let steps = 20_000;
    let limits = Limits {
        steps,
        ..Limits::default()
    };
    for text in [&text, "rule r(x) { box(x, 1, 1) r(x) } for i in 9 r(i)"] {
        assert_same(text, limits.clone(), &[(4, 0, false)]);
    }
}
