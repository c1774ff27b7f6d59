//! One file a command: read, call the library, write, say what was done.

pub(crate) mod attack;
pub(crate) mod catalogue;
pub(crate) mod commit;
pub(crate) mod compare;
pub(crate) mod completions;
pub(crate) mod demo;
pub(crate) mod detect;
pub(crate) mod embed;
pub(crate) mod info;
pub(crate) mod man;
pub(crate) mod prepare;
pub(crate) mod render;
pub(crate) mod search;
pub(crate) mod trace;
pub(crate) mod verify;
