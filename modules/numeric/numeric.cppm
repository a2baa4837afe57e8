// SPDX-License-Identifier: MIT
//
// cilantro.numeric: computation that several modules share: eigenvalues of large symmetric
// matrices, and disjoint sets.
export module cilantro.numeric;

export import cilantro.core;
export import :disjoint_sets;
export import :eigenpairs;
