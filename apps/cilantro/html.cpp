// SPDX-License-Identifier: MIT
#include <CLI/CLI.hpp>
#include <iostream>
#include <memory>
#include <string>

#include "commands.hpp"
#include "common_options.hpp"

import cilantro.visualization;
import drawing;
import tool;
using namespace cilantro;

namespace {

struct html_settings : drawing_settings {
  std::string output, title;
};

void run(const html_settings& settings) {
  const scene all = scene_of(settings);
  progress_line line{"writing", settings.quiet};
  write_html(all, view_of(all, settings), settings.output,
             {.title = settings.title.empty() ? all.layers()[0].name : settings.title,
              .background = options_of({}, settings).background,
              .monitor = line.monitor()});
  if (!settings.quiet) std::cerr << "a page is in " << settings.output << '\n';
}

}  // namespace

void add_html(CLI::App& app) {
  const auto settings = std::make_shared<html_settings>();
  auto* command =
      app.add_subcommand("html", "Makes one web page of clouds, to be turned in a browser");
  add_drawing_options(*command, *settings);
  command->add_option("-o,--output", settings->output, "The HTML file to write")->required();
  command->add_option("--title", settings->title, "Of the page (the name of the first file)");
  command->callback([settings] { run(*settings); });
}
