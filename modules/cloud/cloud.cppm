// SPDX-License-Identifier: MIT
//
// cilantro.cloud: points with what belongs to them, pipelines of steps, and files.
export module cilantro.cloud;

export import cilantro.core;
export import cilantro.search;
export import cilantro.geometry;
export import :attribute;
export import :point_cloud;
export import :filters;
export import :depth_cloud;
export import :pipeline;
export import :steps;
export import :report;
