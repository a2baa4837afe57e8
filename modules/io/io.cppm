// SPDX-License-Identifier: MIT
//
// cilantro.io: clouds, matrices and images in files.
export module cilantro.io;

export import cilantro.cloud;
export import :file_options;
export import :ply;
export import :pcd;
export import :text;
export import :cloud_file;
export import :matrix_file;
export import :image_file;
