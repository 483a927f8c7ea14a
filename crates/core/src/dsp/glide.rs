//! A number that goes to a new value in a straight line, so that a gain changes without a click. Real-time safe.

/// A number and where it goes.
///
/// ```
/// use chalumeau_core::dsp::glide::Glide;
///
/// let mut gain = Glide::new(1.0, 0.002, 1000.0);
/// gain.go_to(0.0);
/// assert_eq!([gain.next(), gain.next(), gain.next()], [0.5, 0.0, 0.0]);
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Glide {
    now: f32,
    target: f32,
    step: f32,
    /// Samples until it arrives.
    left: u32,
    /// Samples that the way takes.
    samples: u32,
}

impl Glide {
    /// At rest at `value`; each way takes `seconds` at `rate_hz`.
    pub fn new(value: f32, seconds: f64, rate_hz: f64) -> Self {
        let samples = (seconds * rate_hz).round().max(1.0) as u32;
        Self { now: value, target: value, step: 0.0, left: 0, samples }
    }

    /// Goes to `value` from where it is.
    pub fn go_to(&mut self, value: f32) {
        if value != self.target {
            self.target = value;
            self.left = self.samples;
            self.step = (value - self.now) / self.samples as f32;
        }
    }

    /// Where it goes, or rests.
    pub fn target(&self) -> f32 {
        self.target
    }

    /// Is at `value` at once.
    pub fn set(&mut self, value: f32) {
        *self = Self { now: value, target: value, step: 0.0, left: 0, samples: self.samples };
    }

    /// Whether it rests at `value`.
    pub fn rests_at(&self, value: f32) -> bool {
        self.left == 0 && self.now == value
    }

    /// Samples until it arrives; without end if it rests.
    pub fn reach(&self) -> usize {
        if self.left > 0 { self.left as usize } else { usize::MAX }
    }

    /// The value of the next sample; after the last step exactly the target.
    #[expect(clippy::should_implement_trait, reason = "it never ends")]
    pub fn next(&mut self) -> f32 {
        if self.left > 0 {
            self.left -= 1;
            self.now = if self.left == 0 { self.target } else { self.now + self.step };
        }
        self.now
    }
}
