// SPDX-License-Identifier: MIT
//
// cilantro.registration: finding the transform that moves one set of points onto another.
export module cilantro.registration;

export import cilantro.core;
export import cilantro.search;
export import cilantro.geometry;
export import cilantro.cloud;
export import :correspondence;
export import :concepts;
export import :nearest_neighbor;
export import :feature_space;
export import :feature_searcher;
export import :projective;
export import :known_pairs;
export import :combined_searcher;
export import :motion;
export import :residual;
export import :colored;
export import :normal_equations;
export import :estimation;
export import :least_squares;
export import :point_to_point;
export import :icp;
export import :deformation_graph;
export import :warp_field;
export import :warp_equations;
export import :warp_engine;
export import :warp_estimator;
export import :align_non_rigid;
export import :evaluate;
export import :align;
export import :align_step;
export import :contract;
