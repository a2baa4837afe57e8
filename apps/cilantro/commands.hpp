// SPDX-License-Identifier: MIT
//
// The commands of the program. Each adds itself to the command line, and runs when it is chosen.
#pragma once

namespace CLI {
class App;
}

class job_of_ranks;

void add_info(CLI::App& app);
void add_convert(CLI::App& app);
/// These divide the tiles of a survey among the ranks of a job, if there is one.
void add_run(CLI::App& app, job_of_ranks* ranks);
void add_tile(CLI::App& app, job_of_ranks* ranks);
void add_align(CLI::App& app);
void add_warp(CLI::App& app);
void add_odometry(CLI::App& app);
void add_model(CLI::App& app);
void add_segment(CLI::App& app);
void add_plane(CLI::App& app);
void add_hull(CLI::App& app);
void add_crop(CLI::App& app);
void add_picture(CLI::App& app);
void add_html(CLI::App& app);
void add_view(CLI::App& app);
