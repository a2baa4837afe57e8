// SPDX-License-Identifier: MIT
//
// cilantro.numeric: computation that several modules share: eigenvalues of large symmetric
// matrices, sparse symmetric systems of blocks, and disjoint sets.
export module cilantro.numeric;

export import cilantro.core;
export import :block_cholesky;
export import :disjoint_sets;
export import :eigenpairs;
