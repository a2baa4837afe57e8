// SPDX-License-Identifier: MIT
//
// cilantro.cloud: point clouds with normals, colours and attributes, and pipelines of steps on
// them.
export module cilantro.cloud;

export import cilantro.core;
export import cilantro.search;
export import cilantro.geometry;
export import :attribute;
export import :point_cloud;
export import :choice;
export import :pipeline;
export import :filters;
export import :combine;
export import :estimate;
export import :depth_cloud;
export import :gradients;
export import :steps;
export import :each;
export import :sinks;
export import :report;
