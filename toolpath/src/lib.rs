//! toolpath
