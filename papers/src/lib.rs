//! What each paper says: tables, claims, errata and their evidence.
