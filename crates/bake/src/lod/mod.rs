//! What does a model look like from afar?
