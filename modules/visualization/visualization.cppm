// SPDX-License-Identifier: MIT
//
// cilantro.visualization: scenes, and pictures and web pages of them, without a display.
export module cilantro.visualization;

export import cilantro.io;
export import :color_map;
export import :canvas;
export import :scene;
export import :view;
export import :clouds;
export import :shapes;
export import :render;
export import :picture;
export import :html;
export import :images;
export import :video;
export import :vertices;
