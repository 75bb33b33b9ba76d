//! Where can an eye be?
