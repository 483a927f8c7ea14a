//! What a knob should feel: how hard a note is to blow, and what that means in degrees and millinewton metres.
