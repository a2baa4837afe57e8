// SPDX-License-Identifier: MIT
#include <CLI/CLI.hpp>
#include <fstream>
#include <iostream>
#include <iterator>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "commands.hpp"
#include "common_options.hpp"

import cilantro;
import cilantro.visualization;
import drawing;
import scan_io;
import tool;
using namespace cilantro;

namespace {

using json = nlohmann::ordered_json;

struct warp_settings {
  std::string source, target, output, landmarks;
  result_drawings drawings;
  double spacing = 0, max_distance = std::numeric_limits<double>::infinity();
  double stiffness = non_rigid_options{}.stiffness, kernel = 0;
  std::optional<double> rigidity;
  int iterations = non_rigid_options{}.max_iterations,
      final_iterations = non_rigid_options{}.final_iterations, threads = 0;
  index_t normals = 10;
  bool affine = false, as_json = false, quiet = false;
  depth_settings depth;
};

/// Pairs of numbers of points.
std::vector<std::pair<index_t, index_t>> read_landmarks(const std::string& path) {
  std::ifstream in{path};
  if (!in) throw std::runtime_error{path + ": cannot be read"};
  const std::vector<index_t> numbers(std::istream_iterator<index_t>{in}, {});
  if (!in.eof() || std::ssize(numbers) % 2 != 0)
    throw std::runtime_error{path + ": a landmark is two whole numbers, of a point of each cloud"};
  std::vector<std::pair<index_t, index_t>> landmarks;
  for (auto n = numbers.begin(); n != numbers.end(); n += 2) landmarks.emplace_back(n[0], n[1]);
  return landmarks;
}

non_rigid_options options_of(const warp_settings& settings) {
  non_rigid_options options{.spacing = settings.spacing,
                            .max_distance = settings.max_distance,
                            .stiffness = settings.stiffness,
                            .kernel_scale = settings.kernel,
                            .rigidity = settings.rigidity,
                            .normals = knn{settings.normals},
                            .max_iterations = settings.iterations,
                            .final_iterations = settings.final_iterations,
                            .threads = settings.threads};
  if (!settings.landmarks.empty()) options.landmarks = read_landmarks(settings.landmarks);
  return options;
}

template <class Motion, class S>
void run(const warp_settings& settings, point_cloud<S, 3> source, const point_cloud<S, 3>& target) {
  // A field is relative to one origin for both.
  const Eigen::VectorXd shift = target.full_origin() - source.full_origin();
  source.points.colwise() -= shift.cast<S>();
  source.origin = target.origin;

  const auto found = [&] {
    progress_line line{"warping", settings.quiet};
    auto options = options_of(settings);
    options.monitor = line.monitor();
    return align_non_rigid<Motion>(source, target, options);
  }();
  const json description{{"status", to_string(found.status)},
                         {"converged", found.converged()},
                         {"iterations", found.iterations},
                         {"pairs", found.pairs},
                         {"overlap", found.overlap},
                         {"rmse", found.rmse},
                         {"residual", found.residual},
                         {"energy", found.energy},
                         {"nodes", found.transform.graph().nodes().size()},
                         {"unsupported_nodes", found.unsupported_nodes.size()}};
  if (settings.as_json)
    std::cout << description.dump(2) << '\n';
  else
    for (const auto& [key, value] : description.items())
      std::cout << key << ": " << value.dump() << '\n';
  if (found.status == icp_status::too_few_pairs)
    throw std::runtime_error{
        "no field was found: there are too few pairs; try another --max-distance"};
  const auto warped =
      warp(std::move(source), found.transform, execution{.threads = settings.threads});
  if (!settings.output.empty()) write_cloud(warped, settings.output);
  if (settings.drawings.any()) {
    const scene all = in_two_colors(target, warped);
    draw_result(all, fit(all), settings.drawings);
  }
}

}  // namespace

void add_warp(CLI::App& app) {
  const auto settings = std::make_shared<warp_settings>();
  auto* command = app.add_subcommand("warp", "Bends one cloud onto another");
  command->add_option("SOURCE", settings->source, "What is bent")->required();
  command->add_option("TARGET", settings->target, "What it is bent onto")->required();
  command
      ->add_option("--spacing", settings->spacing,
                   "Distance between the nodes that move the points around them")
      ->required()
      ->check(CLI::PositiveNumber);
  command
      ->add_option("--max-distance", settings->max_distance,
                   "As far as parts have moved: points farther apart are no pair; no limit if it "
                   "is left out")
      ->check(CLI::PositiveNumber);
  command
      ->add_option("--stiffness", settings->stiffness,
                   "How much neighbouring nodes are kept alike in the end")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  command
      ->add_option("--kernel", settings->kernel,
                   "What counts as far in the end; an eighth of the spacing if it is left out")
      ->check(CLI::PositiveNumber);
  auto* affine = command->add_flag("--affine", settings->affine, "Nodes stretch and shear, too");
  command
      ->add_option("--rigidity", settings->rigidity,
                   "How much nodes that stretch and shear are held to rotations; 0.01 if it is "
                   "left out")
      ->check(CLI::NonNegativeNumber)
      ->needs(affine);
  command->add_option(
      "--landmarks", settings->landmarks,
      "A file with the numbers, from 0, of a source and a target point on each line");
  command->add_option("--iterations", settings->iterations, "At most, at each scale but the last")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  command
      ->add_option("--final-iterations", settings->final_iterations, "At most, at the last scale")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  command->add_option("--normals", settings->normals, "Neighbours for normals that are missing")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  command->add_option("-o,--output", settings->output,
                      "The bent source; its ending says the format");
  add_result_options(*command, settings->drawings);
  add_common_options(*command, *settings);
  command->callback([settings] {
    check(settings->drawings);
    auto source = read_input(settings->source, settings->depth, settings->quiet).cloud;
    const auto target = read_input(settings->target, settings->depth, settings->quiet).cloud;
    const auto bend = [&]<class S>(point_cloud<S, 3> a, const point_cloud<S, 3>& b) {
      if (settings->affine)
        run<affine_motion>(*settings, std::move(a), b);
      else
        run<rigid_motion>(*settings, std::move(a), b);
    };
    std::visit(
        [&]<class A, class B>(A&& a, const B& b) {
          if constexpr (std::is_same_v<std::remove_cvref_t<A>, B>)
            bend(std::forward<A>(a), b);
          else
            bend(cast<double>(a), cast<double>(b));
        },
        std::move(source), target);
  });
}
