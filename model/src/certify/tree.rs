//! Stored certificates.
