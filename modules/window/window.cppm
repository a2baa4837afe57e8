// SPDX-License-Identifier: MIT
//
// cilantro.window: scenes on the screen, in windows with a mouse and keys.
export module cilantro.window;

export import cilantro.visualization;
export import :key;
export import :on_screen;
export import :image_viewer;
export import :show;
export import :card_renderer;
