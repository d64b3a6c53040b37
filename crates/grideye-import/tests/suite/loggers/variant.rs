//! A kind of file that a logger writes.

use super::scene::Scene;
use super::truth::Truth;

/// A file, and what is in it.
pub(crate) struct Written {
    pub(crate) name: &'static str,
    pub(crate) bytes: Vec<u8>,
    pub(crate) truth: Truth,
}

/// What a reader may do without options.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Accept {
    /// The file says all of it.
    Right,
    /// What a careful person would look at twice.
    RightOrAsked,
    /// The file does not say it: whatever is read is a guess.
    Asked,
    /// No frames of this sensor: the error has one of these words.
    Named(&'static [&'static str]),
    /// No frames of this sensor, or frames that somebody changed: asked, or the error has one of these words.
    AskedOrNamed(&'static [&'static str]),
    /// Frames in a wrapping that a reader may refuse with one of these words.
    RightOrNamed(&'static [&'static str]),
}

impl Accept {
    pub(crate) const fn has_right(self) -> bool {
        matches!(
            self,
            Self::Right | Self::RightOrAsked | Self::RightOrNamed(_)
        )
    }

    pub(crate) const fn names(self) -> &'static [&'static str] {
        match self {
            Self::Named(names) | Self::AskedOrNamed(names) | Self::RightOrNamed(names) => names,
            Self::Right | Self::RightOrAsked | Self::Asked => &[],
        }
    }
}

type Write = Box<dyn Fn(&mut Scene) -> Written>;

pub(crate) struct Variant {
    pub(crate) kind: &'static str,
    pub(crate) name: &'static str,
    pub(crate) accept: Accept,
    pub(crate) write: Write,
}

/// The variants of one kind.
pub(crate) struct Kind {
    name: &'static str,
    file: &'static str,
    pub(crate) variants: Vec<Variant>,
}

impl Kind {
    pub(crate) const fn new(name: &'static str) -> Self {
        Self {
            name,
            file: "walk.csv",
            variants: Vec::new(),
        }
    }

    /// The name of the files that follow.
    pub(crate) const fn file(&mut self, file: &'static str) {
        self.file = file;
    }

    /// A file that says all of it.
    pub(crate) fn right<B: Into<Vec<u8>>>(
        &mut self,
        name: &'static str,
        write: impl Fn(&mut Scene) -> (B, Truth) + 'static,
    ) {
        self.add(name, Accept::Right, write);
    }

    /// A file that may be asked for.
    pub(crate) fn unsure<B: Into<Vec<u8>>>(
        &mut self,
        name: &'static str,
        write: impl Fn(&mut Scene) -> (B, Truth) + 'static,
    ) {
        self.add(name, Accept::RightOrAsked, write);
    }

    pub(crate) fn add<B: Into<Vec<u8>>>(
        &mut self,
        name: &'static str,
        accept: Accept,
        write: impl Fn(&mut Scene) -> (B, Truth) + 'static,
    ) {
        let file = self.file;
        let write = move |scene: &mut Scene| {
            let (bytes, truth) = write(scene);
            Written {
                name: file,
                bytes: bytes.into(),
                truth,
            }
        };
        self.variants.push(Variant {
            kind: self.name,
            name,
            accept,
            write: Box::new(write),
        });
    }
}
