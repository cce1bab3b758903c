//! Experiments that reproduce every table and figure, and the terrain command.
