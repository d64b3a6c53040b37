//! A macro for enums with a stable name for each variant.

/// An enum with a stable name for each variant, used in files; if words follow the names, `Display` prints the words.
macro_rules! named {
    ($(#[$meta:meta])* pub enum $enum:ident { $($(#[$doc:meta])* $variant:ident = $name:literal;)+ }) => {
        grideye_frame::named! {
            $(#[$meta])*
            pub enum $enum { $($(#[$doc])* $variant = $name;)+ }
        }

        impl serde::Serialize for $enum {
            fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
                serializer.serialize_str(self.name())
            }
        }
    };
    ($(#[$meta:meta])* pub enum $enum:ident { $($(#[$doc:meta])* $variant:ident = $name:literal, $words:literal;)+ }) => {
        $crate::names::named! {
            $(#[$meta])*
            pub enum $enum { $($(#[$doc])* $variant = $name;)+ }
        }

        impl std::fmt::Display for $enum {
            fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                formatter.pad(match self { $(Self::$variant => $words),+ })
            }
        }
    };
}

pub(crate) use named;
