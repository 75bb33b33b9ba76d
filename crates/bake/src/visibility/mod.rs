//! What can be seen from each cell?
