// SPDX-License-Identifier: MIT
//
// cilantro.model: shapes and transforms that most of the data agree on.
export module cilantro.model;

export import cilantro.core;
export import cilantro.search;
export import cilantro.geometry;
export import cilantro.cloud;
export import :ransac;
export import :limits;
export import :data;
export import :hyperplane;
export import :line;
export import :sphere;
export import :circle;
export import :cylinder;
export import :point_pairs;
export import :contract;
