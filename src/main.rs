//! The command line of Chalumeau.

fn main() {}
