//! Terrain from feature curves by multigrid diffusion (Hnaidi 2010).
