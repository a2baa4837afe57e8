// SPDX-License-Identifier: MIT
//
// cilantro.consensus: shapes and transforms that most of the data agree with, found by RANSAC.
export module cilantro.consensus;

export import cilantro.core;
export import cilantro.search;
export import cilantro.geometry;
export import :ransac;
export import :constraints;
export import :sample;
export import :hyperplane_family;
export import :line_family;
export import :sphere_family;
export import :circle_family;
export import :cylinder_family;
export import :transform_family;
export import :contract;
