//! `belvedere mesh decode --eye …`: which triangles of a smooth LOD are worth drawing from one place?

use belvedere_scene::smooth::{
    Decoder, Snapshot,
    select::{ClusterTree, Selection, View},
};
use glam::DVec3;

/// An image is so much wider than high.
const ASPECT: f64 = 16.0 / 9.0;

#[derive(Debug, clap::Args)]
pub(super) struct EyeArgs {
    /// Keep only what is worth drawing for an eye here, in model space: fine near it, coarse far away
    #[arg(long, value_name = "X,Y,Z", value_parser = point, allow_hyphen_values = true)]
    eye: Option<DVec3>,
    /// The eye looks at this point, upright, at an image of 16 : 9: what lies outside of it is coarse; without this the
    /// eye looks all around
    #[arg(long, value_name = "X,Y,Z", value_parser = point, allow_hyphen_values = true, requires = "eye")]
    target: Option<DVec3>,
    /// Vertical angle of view, in degrees
    #[arg(long, default_value_t = 60.0, value_parser = angle, requires = "eye")]
    fov: f64,
    /// Height of the image, in pixels
    #[arg(long, default_value_t = 1080, value_parser = clap::value_parser!(u32).range(1..), requires = "eye")]
    height: u32,
    /// By so many pixels the surface may be off
    #[arg(long, default_value_t = 1.0, value_parser = not_negative, allow_negative_numbers = true, requires = "eye")]
    pixels: f64,
    /// By so many times more outside of the image
    #[arg(long, default_value_t = 16.0, value_parser = not_negative, allow_negative_numbers = true, requires = "eye")]
    outside: f64,
}

fn point(text: &str) -> Result<DVec3, String> {
    let numbers: Vec<f64> = text
        .split(',')
        .filter_map(|number| number.trim().parse().ok())
        .collect();
    match numbers[..] {
        [x, y, z] if [x, y, z].iter().all(|x| x.is_finite()) && text.split(',').count() == 3 => Ok(DVec3::new(x, y, z)),
        _ => Err("three numbers with commas between them are wanted, as in 1,2.5,-3".to_owned()),
    }
}

fn angle(text: &str) -> Result<f64, String> {
    let degrees = text.parse().ok().filter(|degrees| (1.0..=179.0).contains(degrees));
    degrees.ok_or_else(|| "an angle from 1 to 179 degrees is wanted".to_owned())
}

fn not_negative(text: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|&number: &f64| number >= 0.0);
    number.ok_or_else(|| "a number is wanted, 0 or more".to_owned())
}

impl EyeArgs {
    pub(super) fn is_given(&self) -> bool {
        self.eye.is_some()
    }

    /// Whoever looks at the place where they are looks nowhere.
    pub(super) fn ensure_direction(&self) -> anyhow::Result<()> {
        anyhow::ensure!(
            self.eye.is_none() || self.eye != self.target,
            "--eye and --target are the same point, so there is no direction to look in: move one, or leave out --target to look all around"
        );
        Ok(())
    }

    /// What the eye sees of all that was decoded, and what that takes in words; `None` without an eye.
    pub(super) fn look(&self, decoder: &Decoder) -> Option<(Snapshot, String)> {
        let eye = self.eye?;
        let least = decoder.header().and_then(|header| match &header.cuts[..] {
            [first, _, ..] => Some(first.triangles as usize),
            _ => None,
        });
        let mut selection = Selection::new(ClusterTree::new(decoder), least.unwrap_or(0));
        let done = selection.update(&self.view(eye), usize::MAX);
        let (clusters, triangles) = selection.counts();
        let told = format!(
            "seen from {},{},{} with {} px: {clusters} vertices of the cut, {triangles} of {} triangles after {} splits",
            eye.x,
            eye.y,
            eye.z,
            self.pixels,
            decoder.counts().1,
            done.splits,
        );
        Some((selection.snapshot(decoder), told))
    }

    fn view(&self, eye: DVec3) -> View {
        let half = (self.fov.to_radians() / 2.0).tan();
        let planes = self.target.map(|target| {
            let ahead = (target - eye).try_normalize().unwrap_or(DVec3::NEG_Z);
            let right = ahead.cross(DVec3::Y).try_normalize().unwrap_or(DVec3::X);
            let up = right.cross(ahead);
            // The normal of each side leans from the side towards where the eye looks.
            let sides = [(up, half), (-up, half), (right, half * ASPECT), (-right, half * ASPECT)];
            let normals = sides.map(|(side, reach)| (side + ahead * reach).normalize());
            let planes = normals
                .into_iter()
                .map(|normal| [normal.x, normal.y, normal.z, -normal.dot(eye)]);
            planes.collect()
        });
        View {
            eye: eye.to_array(),
            planes: planes.unwrap_or_default(),
            pixels: f64::from(self.height) / (2.0 * half),
            most_error_px: self.pixels,
            outside: self.outside.max(1.0),
        }
    }
}
