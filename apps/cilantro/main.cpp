// SPDX-License-Identifier: MIT
//
// cilantro
// info|convert|run|tile|align|warp|odometry|model|segment|plane|hull|crop|picture|html|view: point
// clouds on the command line. Ends with 0, with 1 if something failed, and with 2 if the command
// line makes no sense.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <exception>
#include <iostream>
#include <string>

#include "commands.hpp"
#include "ranks.hpp"

import cilantro.core;

int main(int argc, char** argv) {
  const auto ranks = start_ranks(argc, argv);
  CLI::App app{
      "Reads, converts, processes, tiles, aligns, bends, follows, segments and draws point clouds.",
      "cilantro"};
  app.require_subcommand(1);
  app.set_version_flag("--version", [] {
    using cilantro::version;
    return "cilantro " + std::to_string(version.major) + "." + std::to_string(version.minor) + "." +
           std::to_string(version.patch);
  });
  app.footer(
      "Files are .ply, .pcd, .las, .xyz, .txt, .asc, .csv, .pts; to read, also .laz, .e57, .ptx, "
      ".npy, "
      ".bin, depth images as .png, and folders of tiles.");
  add_info(app);
  add_convert(app);
  add_run(app, ranks.get());
  add_tile(app, ranks.get());
  add_align(app);
  add_warp(app);
  add_odometry(app);
  add_model(app);
  add_segment(app);
  add_plane(app);
  add_hull(app);
  add_crop(app);
  add_picture(app);
  add_html(app);
  add_view(app);
  try {
    app.parse(argc, argv);
  } catch (const CLI::CallForHelp& help) {
    return app.exit(help);
  } catch (const CLI::CallForAllHelp& help) {
    return app.exit(help);
  } catch (const CLI::CallForVersion& version) {
    return app.exit(version);
  } catch (const CLI::ParseError& error) {
    if (argc > 1 && argv[1][0] != '-' &&
        std::ranges::none_of(app.get_subcommands({}),
                             [&](const auto* one) { return one->get_name() == argv[1]; })) {
      std::cerr << "cilantro: there is no command " << argv[1] << "; try --help\n";
      return 2;
    }
    std::cerr << "cilantro: " << error.what() << "; try --help\n";
    return 2;
  } catch (const std::exception& error) {
    std::cerr << "cilantro: " << error.what() << '\n';
    return 1;
  }
}
