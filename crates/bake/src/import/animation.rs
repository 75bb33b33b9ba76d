//! Where do nodes stand at a moment of an animation? For pictures of what moves; nothing else of an animation is published.
//!
//! glTF 2.0 §3.11: each channel gives one property of one node at times, between which it steps, goes straight (rotations
//! on the shortest arc), or follows cubic Hermite splines (appendix C). Before the first time and after the last it keeps
//! what it has there. Channels of morph weights, and of what extensions animate, are left alone.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;

use glam::{DMat4, DQuat, DVec4};

use super::accessors::Accessor;
use super::document::Item;
use super::error::{Read, flaw};
use super::local::{Local, unit};
use super::nodes::Hierarchy;
use super::reader::Reader;

/// How the scene stands at equidistant moments of an animation.
#[derive(Debug)]
pub(super) struct Movement {
    /// For each moment where each node of the hierarchy stands, in its order.
    pub(super) worlds: Vec<Vec<DMat4>>,
    pub(super) duration_s: f64,
}

/// One animation of the document.
#[derive(Debug)]
struct Animation {
    channels: Vec<Channel>,
    /// Its first time.
    start_s: f64,
    duration_s: f64,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Path {
    Translation,
    Rotation,
    Scale,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Interpolation {
    Step,
    Linear,
    Cubic,
}

/// How one property of a node changes.
#[derive(Debug)]
struct Channel {
    node: usize,
    path: Path,
    interpolation: Interpolation,
    /// Rising, at least one.
    times_s: Vec<f64>,
    values: Accessor,
}

impl Movement {
    /// Samples the animation of this name, or else the first: the first moment is its start, and the last one step before its
    /// end, which is the start again.
    pub(super) fn sample(
        reader: &mut Reader,
        hierarchy: &Hierarchy,
        (name, frames): (Option<&str>, u32),
    ) -> Read<Self> {
        let animation = Animation::open(reader, name)?;
        let count = hierarchy.nodes.len() * frames as usize;
        reader
            .budget
            .claim(count, size_of::<DMat4>(), || "/animations".to_owned())?;
        let share = |frame: u32| f64::from(frame) / f64::from(frames);
        let worlds = (0..frames).map(|frame| animation.worlds(&reader.root, hierarchy, share(frame)));
        Ok(Self {
            worlds: worlds.collect::<Read<_>>()?,
            duration_s: animation.duration_s,
        })
    }
}

impl Animation {
    /// Opens the animation of this name, or else the first.
    fn open(reader: &mut Reader, name: Option<&str>) -> Read<Self> {
        let count = reader.root.length("animations");
        let called = |reader: &Reader, i: usize| {
            let animation = reader.root.listed("animations", i);
            animation.is_ok_and(|animation| name.is_none() || animation.name() == name)
        };
        let Some(index) = (0..count).find(|i| called(reader, *i)) else {
            let asked = name.map_or_else(String::new, |name| format!(": \"{name}\""));
            return flaw(
                "no such animation for the `frames` of an impostor: one pose drawn",
                format!("/animations{asked}"),
            );
        };
        let animation = reader.root.listed("animations", index)?;
        let mut channels = Vec::new();
        for channel in animation.elements("channels")? {
            let read = Channel::open(reader, &animation, &channel);
            channels.extend(reader.settle(read)?.flatten());
        }
        let times = || channels.iter().flat_map(|channel| &channel.times_s).copied();
        let (start_s, end_s) = (times().fold(f64::INFINITY, f64::min), times().fold(0.0, f64::max));
        if end_s <= start_s || channels.is_empty() {
            return flaw("animation in which nothing moves: one pose drawn", animation.place);
        }
        Ok(Self {
            channels,
            start_s,
            duration_s: end_s - start_s,
        })
    }

    /// Where each node of the hierarchy stands after a share of the duration, 0 to 1; in its order.
    fn worlds(&self, root: &Item, hierarchy: &Hierarchy, share: f64) -> Read<Vec<DMat4>> {
        let time_s = self.start_s + share * self.duration_s;
        let mut locals: BTreeMap<usize, Local> = BTreeMap::new();
        for channel in &self.channels {
            let local = match locals.entry(channel.node) {
                Entry::Occupied(known) => known.into_mut(),
                Entry::Vacant(free) => free.insert(Local::of(&root.listed("nodes", channel.node)?)?),
            };
            channel.apply(time_s, local);
        }
        let mut worlds: Vec<DMat4> = Vec::with_capacity(hierarchy.nodes.len());
        for node in &hierarchy.nodes {
            let local = match locals.get(&node.index) {
                Some(animated) => *animated,
                None => Local::of(&root.listed("nodes", node.index)?)?,
            };
            let world_from_parent = node.parent.map_or(DMat4::IDENTITY, |parent| worlds[parent]);
            worlds.push(world_from_parent * local.parent_from_node());
        }
        Ok(worlds)
    }
}

impl Channel {
    /// Opens a channel; `None` for what is left alone.
    fn open(reader: &mut Reader, animation: &Item, channel: &Item) -> Read<Option<Self>> {
        let target = channel.needed("target")?;
        let (path, components) = match target.text("path")? {
            Some("translation") => (Path::Translation, 3),
            Some("rotation") => (Path::Rotation, 4),
            Some("scale") => (Path::Scale, 3),
            _ => return Ok(None),
        };
        let Some(node) = target.index("node")? else {
            return Ok(None);
        };
        if reader.root.listed("nodes", node)?.member("matrix").is_some() {
            return flaw("animated node with a matrix: channel left out", target.place);
        }
        let number = channel.needed("sampler")?.as_index()?;
        let Some(sampler) = animation.elements("samplers")?.into_iter().nth(number) else {
            return flaw(
                "reference to something that is not there: left out with what needs it",
                format!("{}/sampler", channel.place),
            );
        };
        let interpolation = match sampler.text("interpolation")? {
            None | Some("LINEAR") => Interpolation::Linear,
            Some("STEP") => Interpolation::Step,
            Some("CUBICSPLINE") => Interpolation::Cubic,
            Some(_) => {
                return flaw(
                    "unknown interpolation: channel left out",
                    format!("{}/interpolation", sampler.place),
                );
            }
        };
        let input = reader.accessor(sampler.needed("input")?.as_index()?)?;
        let values = reader.accessor(sampler.needed("output")?.as_index()?)?;
        let of_time = if interpolation == Interpolation::Cubic { 3 } else { 1 };
        let count = input.count.min(values.count / of_time);
        reader.budget.claim(count, size_of::<f64>(), || sampler.place.clone())?;
        let times_s: Vec<f64> = (0..count).map(|i| f64::from(input.floats::<1>(i)[0])).collect();
        let rises = times_s.is_sorted_by(|a, b| a < b) && times_s.first().is_some_and(|first| *first >= 0.0);
        if !rises || input.layout.components != 1 || values.layout.components != components {
            return flaw(
                "channel whose times do not rise or whose values are of another kind: left out",
                sampler.place,
            );
        }
        Ok(Some(Self {
            node,
            path,
            interpolation,
            times_s,
            values,
        }))
    }

    /// Sets the property of its node as it is at a time.
    fn apply(&self, time_s: f64, local: &mut Local) {
        let value = self.at(time_s);
        if !value.is_finite() {
            return;
        }
        match self.path {
            Path::Translation => local.translation = value.truncate(),
            Path::Rotation => local.rotation = unit(DQuat::from_vec4(value)),
            Path::Scale => local.scale = value.truncate(),
        }
    }

    fn at(&self, time_s: f64) -> DVec4 {
        let after = self.times_s.partition_point(|time| *time <= time_s);
        let last = self.times_s.len() - 1;
        if after == 0 || after > last {
            return self.key(after.min(last));
        }
        let before = after - 1;
        let length_s = self.times_s[after] - self.times_s[before];
        let t = (time_s - self.times_s[before]) / length_s;
        let (a, b) = (self.key(before), self.key(after));
        match self.interpolation {
            Interpolation::Step => a,
            Interpolation::Linear if self.path == Path::Rotation => {
                let [a, b] = [a, b].map(|key| unit(DQuat::from_vec4(key)));
                DVec4::from(a.slerp(b, t))
            }
            Interpolation::Linear => a.lerp(b, t),
            Interpolation::Cubic => {
                let (out, into) = (
                    self.element(3 * before + 2) * length_s,
                    self.element(3 * after) * length_s,
                );
                let (t2, t3) = (t * t, t * t * t);
                a * (2.0 * t3 - 3.0 * t2 + 1.0)
                    + out * (t3 - 2.0 * t2 + t)
                    + b * (3.0 * t2 - 2.0 * t3)
                    + into * (t3 - t2)
            }
        }
    }

    /// The value at a time that is given; between the two tangents that a spline has there.
    fn key(&self, index: usize) -> DVec4 {
        self.element(match self.interpolation {
            Interpolation::Cubic => 3 * index + 1,
            _ => index,
        })
    }

    fn element(&self, index: usize) -> DVec4 {
        DVec4::from_array(self.values.floats::<4>(index).map(f64::from))
    }
}
