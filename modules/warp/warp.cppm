// SPDX-License-Identifier: MIT
//
// cilantro.warp: finding the field of many motions that bends one set of points onto another.
export module cilantro.warp;

export import cilantro.core;
export import cilantro.search;
export import cilantro.cloud;
export import cilantro.registration;
export import :deformation_graph;
export import :warp_field;
export import :warp_equations;
export import :warp_engine;
export import :warp_estimator;
export import :align_non_rigid;
