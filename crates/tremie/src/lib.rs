//! Program library
