//! Does the program do what its users see? Runs the real binary on a free port with a temporary data folder, and looks
//! at the result through the client crate, as any program of a user would.

mod auditing;
mod auditing_doors;
mod auditing_promises;
mod bad_input;
mod boxes;
mod doors;
mod explaining;
mod exploring;
mod growing;
mod live;
#[path = "../http/live_wire.rs"]
mod live_wire;
mod meeting;
mod meshing;
mod private;
mod program;
mod publishing;
mod rambling;
mod resuming;
#[path = "../tools/scenes.rs"]
mod scenes;
mod smooth;
mod standing_in;
mod triangles;
mod uploading;
mod verifying;
mod visible;
mod visiting;
mod walking;
mod wardrobe;
mod watched;
#[path = "../http/wire.rs"]
mod wire;
