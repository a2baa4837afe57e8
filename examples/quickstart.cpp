// SPDX-License-Identifier: MIT
//
// From two scans to one processed cloud and its parts: quickstart [scan.ply | depth.png [second]]
#include <exception>
#include <filesystem>
#include <iostream>
#include <utility>

import cilantro;
import cilantro.visualization;
import scan_io;
using namespace cilantro;

/// The same scan from elsewhere, for a user who has only one.
scan moved(scan one, double distance) {
  one.cloud = one.cloud | transform(Eigen::Translation3f{float(distance), 0, 0} *
                                    Eigen::AngleAxisf{0.03f, Eigen::Vector3f::UnitY()} *
                                    Eigen::Isometry3f::Identity());
  return one;
}

int main(int argc, char** argv) try {
  pipeline_report report;
  scan first = argc > 1 ? open_scan(argv[1]) : simulated_scan(0);
  const double voxel = diagonal(first.cloud) / 300;
  scan second = argc > 2   ? open_scan(argv[2])
                : argc > 1 ? moved(first, 3 * voxel)
                           : simulated_scan(2);
  const Eigen::Vector3f eye = first.camera.to_world.translation();

  std::filesystem::create_directory("out");
  const auto prepare =
      remove_invalid() | voxel_downsample(voxel) | estimate_normals(knn{10}, {.viewpoint = eye});
  const auto target = std::move(first.cloud) | report_to(report, "read") | prepare |
                      report_to(report, "clean, downsample, normals");
  const auto source = std::move(second.cloud) | prepare;

  icp_result<Eigen::Isometry3f> found;
  // clang-format off
  const auto aligned = source
      | report_to(report, "the same of a second scan")
      | align_to(target, {.scales = {{4 * voxel, 20 * voxel}, {0, 5 * voxel}}}, &found)
      | report_to(report, "align");
  auto both = append(target, aligned)
      | write_ply("out/cloud.ply")
      | report_to(report, "write out/cloud.ply");
  // clang-format on

  const auto parts = connected_components(both, knn{30}, similar_normals{both.normals, 0.14},
                                          {.min_cluster_size = 50});
  both.colors = label_colors(parts.labels());

  const auto seen = [&](const scene& what) {
    return render(what, view{first.camera}, {.supersampling = 2});
  };
  write_png(side_by_side(seen(in_two_colors(target, source)),
                         side_by_side(seen(in_two_colors(target, aligned)),
                                      seen(scene{}.set("parts", both)))),
            "out/cloud.png");
  scene layers = in_two_colors(target, aligned);
  write_html(layers.set("parts", both).hide("parts"), view{first.camera, diagonal(target) / 2},
             "out/cloud.html", {.title = "two scans, aligned"});
  std::cout << report << "aligned: " << found.status << " after " << found.iterations
            << " iterations, " << found.pairs << " pairs, overlap " << found.overlap << ", rmse "
            << found.rmse << ", " << found.undetermined << " undetermined directions\n"
            << "segmented: " << parts.size() << " smooth parts, of "
            << (parts.empty() ? 0 : parts[0].size()) << " points the largest\n"
            << "voxels of " << voxel << "; before, after and the parts are in out/cloud.png,\n"
            << "and to be turned, moved and measured in a browser, in out/cloud.html\n";
} catch (const std::exception& error) {
  std::cerr << "quickstart: " << error.what() << '\n';
  return 1;
}
