// SPDX-License-Identifier: MIT
//
// cilantro.numeric: what several areas compute with, and no language of all of them.
export module cilantro.numeric;

export import cilantro.core;
export import :disjoint_sets;
export import :eigenpairs;
