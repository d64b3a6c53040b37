//! The network that counts: two convolutions, a maximum, two dense layers, all in integers.
//!
//! ```text
//! excess 8 x 8 → 3 x 3, c1 → 3 x 3, c2 → maximum of 2 x 2 → dense, hidden → dense, 4 scores
//! ```
//!
//! The file of weights (`.gec`, written by `tests/peers/counting`) begins with `GEC1` and one byte each for c1, c2,
//! hidden and the number of scores. For each layer follow one byte `shift`, the biases (32 bits, little endian) and the
//! weights (8 bits), by output, input, row and column; the dense layers' inputs run over row, column and channel.
//!
//! An activation is in units of 1/256, a weight in units of 2^-shift. A layer's sum is shifted right by `shift`; all
//! but the last layer's outputs are held to 0 to 32767. Integers give the same scores on every machine.

use core::fmt;
use grideye_frame::{COLUMNS, PIXELS, ROWS};

/// Counts with a score of their own: 0, 1, 2, and 3 or more people.
pub const CLASSES: usize = 4;
/// One degree of excess as a network's input.
pub const UNITS_PER_DEGREE: f32 = 256.0;
/// The most channels of a convolution, and the most hidden units.
pub const WIDTH_MAX: usize = 64;
const MAGIC: &[u8; 4] = b"GEC1";
const HEAD_BYTES: usize = MAGIC.len() + 4;
const KERNEL: usize = 3;
const ACTIVATION_MAX: i32 = 32_767;
const POOLED: usize = PIXELS / 4;
/// A frame with a border of zeros.
const PADDED_COLUMNS: usize = COLUMNS + KERNEL - 1;
const PADDED: usize = PADDED_COLUMNS * (ROWS + KERNEL - 1);

/// A trained network: the shipped one by default.
#[derive(Debug, Clone, Copy)]
pub struct Network<'w> {
    first: Layer<'w>,
    second: Layer<'w>,
    hidden: Layer<'w>,
    last: Layer<'w>,
}

impl Default for Network<'static> {
    /// The shipped network. `tests/peers/counting/README.md` says how it was trained.
    fn default() -> Self {
        const SHIPPED: &[u8] = include_bytes!("../weights/counter.gec");
        // A test reads it, so the empty network never counts.
        Network::new(SHIPPED).unwrap_or(Network {
            first: Layer::EMPTY,
            second: Layer::EMPTY,
            hidden: Layer::EMPTY,
            last: Layer::EMPTY,
        })
    }
}

/// Why bytes are not a network.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WeightsError {
    /// They do not begin as a file of weights does.
    NotWeights,
    /// A layer is wider than [`WIDTH_MAX`] or has no width, or there are other than [`CLASSES`] scores.
    Widths,
    /// The file is shorter or longer than its widths say.
    Length {
        /// Bytes that the widths ask for.
        wanted: usize,
        /// Bytes there are.
        found: usize,
    },
    /// A layer's `shift` is above 24.
    Shift(u8),
}

impl fmt::Display for WeightsError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotWeights => {
                formatter.write_str("this is no file of weights: it does not begin with GEC1")
            }
            Self::Widths => write!(
                formatter,
                "the layers have 1 to {WIDTH_MAX} channels and {CLASSES} scores, and this file says otherwise"
            ),
            Self::Length { wanted, found } => {
                write!(
                    formatter,
                    "the file has {found} bytes where its layers take {wanted}"
                )
            }
            Self::Shift(shift) => write!(
                formatter,
                "a layer is shifted by {shift} bits, more than 24"
            ),
        }
    }
}

impl core::error::Error for WeightsError {}

impl<'w> Network<'w> {
    /// Reads a file of weights.
    ///
    /// # Errors
    /// [`WeightsError`] if the bytes are not such a file.
    pub fn new(bytes: &'w [u8]) -> Result<Self, WeightsError> {
        let head = bytes.get(..HEAD_BYTES).ok_or(WeightsError::NotWeights)?;
        let (magic, widths) = head.split_at(MAGIC.len());
        if magic != MAGIC {
            return Err(WeightsError::NotWeights);
        }
        let widths: [usize; 4] = core::array::from_fn(|layer| usize::from(widths[layer]));
        let [c1, c2, hidden, classes] = widths;
        let is_wide = |width: usize| (1..=WIDTH_MAX).contains(&width);
        if !widths.into_iter().all(is_wide) || classes != CLASSES {
            return Err(WeightsError::Widths);
        }
        let kernel = KERNEL * KERNEL;
        let shapes = [
            (kernel, c1),
            (c1 * kernel, c2),
            (c2 * POOLED, hidden),
            (hidden, classes),
        ];
        let layer_bytes = |(inputs, outputs): &(usize, usize)| 1 + outputs * (4 + inputs);
        let wanted = HEAD_BYTES + shapes.iter().map(layer_bytes).sum::<usize>();
        if bytes.len() != wanted {
            let found = bytes.len();
            return Err(WeightsError::Length { wanted, found });
        }
        let mut rest = &bytes[HEAD_BYTES..];
        let mut layers = [Layer::EMPTY; 4];
        for (layer, shape) in layers.iter_mut().zip(&shapes) {
            let (own, after) = rest.split_at(layer_bytes(shape));
            let (biases, weights) = own[1..].split_at(4 * shape.1);
            if own[0] > 24 {
                return Err(WeightsError::Shift(own[0]));
            }
            *layer = Layer {
                shift: own[0],
                inputs: shape.0,
                biases,
                weights,
            };
            rest = after;
        }
        let [first, second, hidden, last] = layers;
        Ok(Self {
            first,
            second,
            hidden,
            last,
        })
    }

    /// The scores of the counts for a frame's excess, in units of 1/[`UNITS_PER_DEGREE`] °C: the logarithms of their
    /// chances up to a constant, in units of 1/256.
    #[must_use]
    pub fn scores(&self, excess: &[i32; PIXELS]) -> [i32; CLASSES] {
        let mut input = [[0; PADDED]; WIDTH_MAX];
        pad(excess, &mut input[0]);
        let mut between = [[0; PADDED]; WIDTH_MAX];
        self.first
            .convolve(&input, |channel, plane| pad(plane, &mut between[channel]));
        let mut pooled = [0; POOLED * WIDTH_MAX];
        let channels = self.second.outputs();
        self.second.convolve(&between, |channel, plane| {
            for (place, most) in maxima(plane).into_iter().enumerate() {
                pooled[place * channels + channel] = most;
            }
        });
        let mut hidden = [0; WIDTH_MAX];
        for (unit, value) in hidden[..self.hidden.outputs()].iter_mut().enumerate() {
            *value = self.hidden.dense(unit, &pooled).clamp(0, ACTIVATION_MAX);
        }
        core::array::from_fn(|class| self.last.dense(class, &hidden))
    }
}

#[derive(Debug, Clone, Copy)]
struct Layer<'w> {
    shift: u8,
    /// Of one output.
    inputs: usize,
    biases: &'w [u8],
    weights: &'w [u8],
}

impl Layer<'_> {
    const EMPTY: Self = Layer {
        shift: 0,
        inputs: 0,
        biases: &[],
        weights: &[],
    };

    fn outputs(&self) -> usize {
        self.biases.len() / 4
    }

    fn bias(&self, output: usize) -> i32 {
        let bytes = self.biases.get(4 * output..4 * output + 4);
        bytes.map_or(0, |bytes| {
            i32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]])
        })
    }

    fn weights(&self, output: usize) -> impl Iterator<Item = i32> {
        let own = self
            .weights
            .iter()
            .skip(output * self.inputs)
            .take(self.inputs);
        own.map(|byte| i32::from(i8::from_ne_bytes([*byte])))
    }

    fn dense(&self, output: usize, inputs: &[i32]) -> i32 {
        let products = self
            .weights(output)
            .zip(inputs)
            .map(|(weight, input)| weight * input);
        products.fold(self.bias(output), i32::wrapping_add) >> self.shift
    }

    /// Hands over each output's plane.
    fn convolve(&self, inputs: &[[i32; PADDED]], mut take: impl FnMut(usize, &[i32; PIXELS])) {
        for output in 0..self.outputs() {
            let mut sums = [self.bias(output); PIXELS];
            for (at, weight) in self.weights(output).enumerate() {
                let (channel, tap) = (at / (KERNEL * KERNEL), at % (KERNEL * KERNEL));
                let shifted = &inputs[channel][tap / KERNEL * PADDED_COLUMNS + tap % KERNEL..];
                for (row, sums) in sums.chunks_exact_mut(COLUMNS).enumerate() {
                    let values = &shifted[row * PADDED_COLUMNS..][..COLUMNS];
                    for (sum, value) in sums.iter_mut().zip(values) {
                        *sum = sum.wrapping_add(weight * value);
                    }
                }
            }
            let plane = sums.map(|sum| (sum >> self.shift).clamp(0, ACTIVATION_MAX));
            take(output, &plane);
        }
    }
}

fn pad(plane: &[i32; PIXELS], padded: &mut [i32; PADDED]) {
    for (row, values) in plane.chunks_exact(COLUMNS).enumerate() {
        padded[(row + 1) * PADDED_COLUMNS + 1..][..COLUMNS].copy_from_slice(values);
    }
}

/// The largest of each square of 2 x 2 pixels.
fn maxima(plane: &[i32; PIXELS]) -> [i32; POOLED] {
    let half = COLUMNS / 2;
    core::array::from_fn(|place| {
        let corner = place / half * 2 * COLUMNS + place % half * 2;
        let square = [corner, corner + 1, corner + COLUMNS, corner + COLUMNS + 1];
        square
            .into_iter()
            .map(|pixel| plane[pixel])
            .fold(i32::MIN, i32::max)
    })
}
