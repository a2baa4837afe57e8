// SPDX-License-Identifier: MIT
//
// cilantro.search: nearest neighbours, by several metrics, and graphs of neighbours.
export module cilantro.search;

export import cilantro.core;
export import :metric;
export import :neighborhood;
export import :neighbor_searcher;
export import :visit;
export import :nearest;
export import :product_search;
export import :brute_force;
export import :kd_tree_nodes;
export import :kd_tree;
export import :pair;
export import :weight;
export import :graph;
export import :contract;
