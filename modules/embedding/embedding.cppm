// SPDX-License-Identifier: MIT
//
// cilantro.embedding: points in few dimensions that preserve given distances.
export module cilantro.embedding;

export import cilantro.core;
export import cilantro.search;
export import cilantro.geometry;
export import :multidimensional_scaling;
export import :shortest_paths;
export import :isomap;
