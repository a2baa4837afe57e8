// SPDX-License-Identifier: MIT
//
// cilantro.core: what all modules build on: views of points, errors, threads, random numbers,
// transforms.
export module cilantro.core;

export import cilantro.eigen;
export import :error;
export import :buffer;
export import :indexed_iterator;
export import :points_view;
export import :points;
export import :oriented_points;
export import :sizes;
export import :range_closure;
export import :to_points;
export import :coordinates;
export import :image;
export import :angle;
export import :positive;
export import :transform;
export import :any_transform;
export import :execution;
export import :parallel;
export import :point_map;
export import :random;
export import :exact_sum;
export import :decompositions;
export import :violations;
export import :vector_target;
export import :version;
