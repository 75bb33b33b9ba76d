//! What does the source file hold?
