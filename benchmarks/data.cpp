// SPDX-License-Identifier: MIT
//
// Writes the data that all benchmark programs read: benchmark_data tasks|sizes|sequence|global
// FOLDER
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <string>
#include <utility>
#include <vector>

#include "pictures.hpp"

import cilantro;
import cilantro.visualization;
import simulated_room;
using namespace cilantro;

namespace {

const pinhole_camera<float> kinect{640, 480, 585, 585, 320, 240};

void write_floats(const std::filesystem::path& path, const Eigen::Matrix3Xf& values) {
  std::ofstream{path, std::ios::binary}.write(reinterpret_cast<const char*>(values.data()),
                                              values.size() * std::streamsize(sizeof(float)));
}

using cloud_type = point_cloud<float, 3>;

/// Writes pairs of scans, and the list of them.
class pair_writer {
 public:
  explicit pair_writer(const std::filesystem::path& folder)
      : folder_{folder}, list_{folder / "pairs.txt"} {
    list_.precision(17);
  }

  void write(const std::string& name, const cloud_type& source, const cloud_type& target,
             double max_distance, int iterations, const Eigen::Isometry3d& truth) {
    const auto with_normals = target | estimate_normals(knn{10});
    write_floats(folder_ / (name + "_source.f32"), source.points);
    write_floats(folder_ / (name + "_target.f32"), with_normals.points);
    write_floats(folder_ / (name + "_normals.f32"), with_normals.normals);
    const bool has_colors = source.has_colors() && target.has_colors();
    if (has_colors) {
      write_floats(folder_ / (name + "_source_colors.f32"), source.colors);
      write_floats(folder_ / (name + "_target_colors.f32"), target.colors);
    }
    list_ << name << ' ' << max_distance << ' ' << iterations << ' ' << has_colors;
    for (int i = 0; i < 16; ++i) list_ << ' ' << truth.matrix()(i / 4, i % 4);
    list_ << '\n';
  }

 private:
  std::filesystem::path folder_;
  std::ofstream list_;
};

Eigen::Isometry3d matrix_in(const std::filesystem::path& path) {
  std::ifstream in{path};
  Eigen::Isometry3d matrix;
  for (int i = 0; i < 16; ++i) in >> matrix.matrix()(i / 4, i % 4);
  return matrix;
}

void write_kinect_pairs(const std::filesystem::path& frames, pair_writer& out) {
  const auto name = [&](const char* number, const char* what) {
    return frames / (std::string{"frame-0000"} + number + what);
  };
  const auto frame = [&](const char* number, double edge) {
    return cloud_from_rgbd(read_depth_png(name(number, ".depth.png")),
                           read_color_image(name(number, ".color.jpg")), kinect) |
           voxel_downsample(edge);
  };
  const auto pose = [&](const char* number) { return matrix_in(name(number, ".pose.txt")); };
  const auto target = frame("00", 0.01);
  for (const char* number : {"01", "10", "20"})
    out.write(std::string{"kinect_"} + number, frame(number, 0.01), target, 0.05, 15,
              pose("00").inverse() * pose(number));
  out.write("kinect_01_5_mm", frame("01", 0.005), frame("00", 0.005), 0.05, 15,
            pose("00").inverse() * pose("01"));
}

/// Scans of the bunny where they belong (bun.conf: p_world = R(q)ᵀ p + t), the second pushed away.
void write_bunny_pair(const std::filesystem::path& scans, pair_writer& out) {
  Eigen::Isometry3f pose = Eigen::Isometry3f::Identity();
  pose.linear() = Eigen::Quaternionf{0.955586f, 0.00548449f, -0.294635f, -0.0038555f}
                      .normalized()
                      .toRotationMatrix()
                      .transpose();
  pose.translation() << -0.0520211f, -0.000383981f, -0.0109223f;
  Eigen::Isometry3f push = Eigen::Isometry3f::Identity();
  push.linear() =
      Eigen::AngleAxisf{0.05f, Eigen::Vector3f{1, 2, 3}.normalized()}.toRotationMatrix();
  push.translation() << 0.002f, -0.002f, 0.001f;
  out.write(
      "bunny",
      read_ply<float>(scans / "bun045.ply") | transform(push * pose) | voxel_downsample(0.001),
      read_ply<float>(scans / "bun000.ply") | voxel_downsample(0.001), 0.01, 30,
      Eigen::Isometry3d{push.inverse().matrix().cast<double>()});
}

void write_lidar_pair(const std::filesystem::path& scans, pair_writer& out) {
  out.write("lidar", read_ply<float>(scans / "source.ply") | voxel_downsample(0.25),
            read_ply<float>(scans / "target.ply") | voxel_downsample(0.25), 1, 30,
            matrix_in(scans / "T_target_source.txt"));
}

/// The vertices of an OBJ file.
cloud_type read_vertices(const std::filesystem::path& path) {
  std::ifstream in{path};
  std::vector<float> all;
  std::string word;
  for (float x = 0, y = 0, z = 0; in >> word; std::getline(in, word))
    if (word == "v" && in >> x >> y >> z) all.insert(all.end(), {x, y, z});
  return {.points = Eigen::Map<const Eigen::Matrix3Xf>{all.data(), 3, std::ssize(all) / 3}};
}

/// Pairs that bend, and the list of them: the distances between nodes and within pairs, and whether
/// point i of the source belongs onto point i of the target.
void write_bending_pairs(const std::filesystem::path& scans, const std::filesystem::path& folder) {
  std::ofstream list{folder / "bending_pairs.txt"};
  const auto write = [&](const std::string& name, const cloud_type& source,
                         const cloud_type& target, double spacing, double max_distance,
                         bool have_truth) {
    const auto with_normals = target.has_normals() ? target : target | estimate_normals(knn{10});
    write_floats(folder / (name + "_source.f32"), source.points);
    write_floats(folder / (name + "_target.f32"), with_normals.points);
    write_floats(folder / (name + "_normals.f32"), with_normals.normals);
    list << name << ' ' << spacing << ' ' << max_distance << ' ' << have_truth << '\n';
  };
  if (const auto frames = scans / "cilantro"; std::filesystem::exists(frames))
    write("frames", read_ply<float>(frames / "frame_2.ply"),
          read_ply<float>(frames / "frame_1.ply"), 0.025, 0.02, false);
  if (const auto jump = scans / "fast_rnrr/jump_s005"; std::filesystem::exists(jump))
    write("jump", read_vertices(jump / "source.obj"), read_vertices(jump / "target.obj"), 0.08, 0.6,
          true);
}

/// For who has none of these.
void write_simulated_pair(pair_writer& out) {
  const auto scan = [](int step) {
    const auto frame = simulate(step, {.noise = 0.001});
    auto camera = frame.camera;
    camera.to_world.setIdentity();
    return cast<float>(cloud_from_depth(frame.depth, camera)) | voxel_downsample(0.01);
  };
  out.write("simulated", scan(2), scan(0), 0.05, 15,
            simulated_camera(0, {}).to_world.inverse() * simulated_camera(2, {}).to_world);
}

const std::filesystem::path real = CILANTRO_TEST_DATA;

Eigen::Matrix3Xf uniform(index_t n) {
  Eigen::Matrix3Xf points(3, n);
  random_stream random{1};
  for (auto p : points.colwise())
    for (float& x : p) x = float(random.uniform());
  return points;
}
/// Most points are near few places.
Eigen::Matrix3Xf clustered(index_t n) {
  Eigen::Matrix3Xf points(3, n);
  random_stream random{2};
  for (auto p : points.colwise()) {
    const auto place = static_cast<std::uint64_t>(random.below(100));
    random_stream of_place{3, place};
    for (float& x : p) x = float(of_place.uniform() + 0.02 * random.normal());
  }
  return points;
}
/// Each point is there ten times.
Eigen::Matrix3Xf duplicates(index_t n) {
  const auto different = uniform(n / 10);
  Eigen::Matrix3Xf points(3, n);
  for (index_t i = 0; i < n; ++i) points.col(i) = different.col(i % different.cols());
  return points;
}
Eigen::Matrix3Xf flat(index_t n) {
  auto points = uniform(n);
  points.row(2) *= 1e-4f;
  return points;
}

void write_sizes(const std::filesystem::path& folder) {
  std::ofstream names{folder / "sets.txt"};
  const auto write = [&](const std::string& name, const Eigen::Matrix3Xf& points) {
    names << name << '\n';
    write_floats(folder / (name + ".f32"), points);
  };
  for (const auto& [name, n] : {std::pair{"uniform_1e4", 10'000},
                                {"uniform_1e5", 100'000},
                                {"uniform_1e6", 1'000'000},
                                {"uniform_1e7", 10'000'000}}) {
    // As dense as a million in a cube of half a metre, so that a radius means the same.
    write(name, uniform(n) * 0.5f * std::cbrt(float(n) / 1e6f));
  }
  write("clustered_1e6", clustered(1'000'000));
  write("duplicates_1e6", duplicates(1'000'000));
  write("flat_1e6", flat(1'000'000));
}

/// Frames of a camera on its way.
struct frames_on_the_way {
  std::vector<point_cloud<float, 3>> clouds;
  std::vector<Eigen::Isometry3d> poses;
  std::vector<int> steps;
};
frames_on_the_way read_frames() {
  frames_on_the_way all;
  auto& [frames, poses, steps] = all;
  const auto kinect_folder = real / "rgbd/7scenes_1000";
  for (int step = 0; step < 1000; ++step) {
    const std::string number = std::to_string(step);
    const auto name = kinect_folder / ("frame-" + std::string(6 - number.size(), '0') + number);
    if (!std::filesystem::exists(name.string() + ".depth.png")) continue;
    frames.push_back(cloud_from_depth(read_depth_png(name.string() + ".depth.png"), kinect) |
                     remove_invalid());
    poses.push_back(matrix_in(name.string() + ".pose.txt"));
    steps.push_back(step);
  }
  for (int step = 0; frames.size() < 49 && (steps.empty() || steps.back() + 1 == step); ++step) {
    const auto simulated = simulate(step, {.noise = 0.001});
    auto camera = simulated.camera;
    poses.push_back(camera.to_world);
    camera.to_world.setIdentity();
    frames.push_back(cast<float>(cloud_from_depth(simulated.depth, camera)) | remove_invalid());
    steps.push_back(step);
  }
  return all;
}

/// The name of a frame.
std::string frame_name(int step) {
  const std::string number = std::to_string(step);
  return "frame_" + std::string(3 - number.size(), '0') + number;
}

/// The frames, and pairs of each and the one before.
void write_sequence(const std::filesystem::path& folder) {
  const auto [frames, poses, steps] = read_frames();
  pair_writer pairs{folder};
  std::ofstream names{folder / "sets.txt"};
  for (std::size_t f = 0; f < frames.size(); ++f) {
    const std::string name = frame_name(steps[f]);
    names << name << '\n';
    write_floats(folder / (name + ".f32"), frames[f].points);
    if (f > 0 && steps[f] == steps[f - 1] + 1)
      pairs.write(name, frames[f] | voxel_downsample(0.01), frames[f - 1] | voxel_downsample(0.01),
                  0.05, 15, poses[f - 1].inverse() * poses[f]);
  }
}

/// The smaller share of points of two sets that are within 10 cm of the other one.
double overlap_of(const cloud_type& target, const cloud_type& source,
                  const Eigen::Isometry3d& pose) {
  const auto moved = transform(source, Eigen::Isometry3f{pose.matrix().cast<float>()});
  const auto share = [](const cloud_type& from, const cloud_type& onto) {
    const auto near = kd_tree{onto.points}.find_all(from.points, knn_in_radius{1, 0.1});
    return double(near.total()) / double(from.size());
  };
  return std::min(share(moved, target), share(target, moved));
}

/// For how many pairs of each kind programs that are slow are asked, too.
constexpr int sampled_pairs_of_a_kind = 120;
int kind_of_overlap(double overlap) {
  return overlap >= 0.7 ? 0 : overlap >= 0.3 ? 1 : overlap >= 0.1 ? 2 : 3;
}

/// All pairs of frames, to be aligned from anywhere; for each the overlap under the recorded poses,
/// these, and where two kinds of ICP end that start there.
void write_global(const std::filesystem::path& folder) {
  const auto [frames, poses, steps] = read_frames();
  std::vector<cloud_type> voxels, with_normals;
  std::ofstream names{folder / "frames.txt"};
  for (std::size_t f = 0; f < frames.size(); ++f) {
    voxels.push_back(frames[f] | voxel_downsample(0.05));
    with_normals.push_back(voxels.back() | estimate_normals(radius{0.1}));
    names << frame_name(steps[f]) << '\n';
    write_floats(folder / (frame_name(steps[f]) + ".f32"), voxels.back().points);
  }

  struct described_pair {
    index_t target, source;
    double overlap;
    bool is_sampled;
  };
  std::vector<described_pair> pairs;
  for (index_t i = 0; i < std::ssize(voxels); ++i)
    for (index_t j = i + 1; j < std::ssize(voxels); ++j)
      pairs.push_back(
          {i, j, overlap_of(voxels[i], voxels[j], poses[i].inverse() * poses[j]), false});
  random_stream random{1};
  std::vector<std::int32_t> order(pairs.size());
  for (std::size_t k = 0; k < order.size(); ++k) {
    order[k] = std::int32_t(k);
    std::swap(order[k], order[std::size_t(random.below(k + 1))]);
  }
  int sampled[4] = {};
  for (const auto k : order) {
    auto& pair = pairs[std::size_t(k)];
    pair.is_sampled = sampled[kind_of_overlap(pair.overlap)]++ < sampled_pairs_of_a_kind;
  }

  std::ofstream list{folder / "pairs.txt"};
  list.precision(9);
  for (const auto& [i, j, overlap, is_sampled] : pairs) {
    const Eigen::Isometry3d recorded = poses[i].inverse() * poses[j];
    const auto end = [&, i = i, j = j](const metric_choice& metric, double max_distance) {
      const auto found =
          align(with_normals[j], with_normals[i],
                {.metric = metric, .initial = recorded, .max_distance = max_distance});
      return Eigen::Matrix4d{found.transform.matrix().cast<double>()};
    };
    list << i << ' ' << j << ' ' << overlap << ' ' << is_sampled;
    for (const Eigen::Matrix4d& matrix :
         {recorded.matrix(), end(point_to_plane{}, 0.1), end(generalized_icp{}, 0.05)})
      for (int k = 0; k < 16; ++k) list << ' ' << matrix(k / 4, k % 4);
    list << '\n';
  }

  // Features that another program has computed, or the library's.
  const auto fragments = real / "registration/open3d_feature";
  int count = 0;
  for (const char* name : {"a", "b"}) {
    Eigen::MatrixXf features;
    const auto path = fragments / ("cloud_bin_" + std::to_string(count) + ".fpfh.bin");
    if (std::ifstream in{path, std::ios::binary}; in) {
      in.seekg(0, std::ios::end);
      Eigen::MatrixXd values(33, (index_t(in.tellg()) - 8) / std::streamoff(33 * sizeof(double)));
      in.seekg(8);
      in.read(reinterpret_cast<char*>(values.data()),
              values.size() * std::streamsize(sizeof(double)));
      features = values.cast<float>();
    } else {
      features = fpfh(with_normals[std::size_t(count)], radius{0.25});
    }
    ++count;
    std::ofstream{folder / ("features_" + std::string{name} + ".f32"), std::ios::binary}.write(
        reinterpret_cast<const char*>(features.data()),
        features.size() * std::streamsize(sizeof(float)));
  }
}

/// What the pictures of other programs need: the colours of the points, where they are seen from
/// (rows of the matrix into the camera's coordinates, focal lengths and principal point), and the
/// picture.
void write_picture_task(const cloud_type& large, const std::filesystem::path& folder) {
  scene all;
  all.set("large", large, cloud_look{.size = splat_length{splat_diameter}, .along_normals = false});
  const view from =
      fit(all, {0, 0, 1}, {0, -1, 0}, {.width = picture_width, .height = picture_height});
  const Eigen::Matrix4f to_camera = from.camera.to_world.inverse().matrix().cast<float>();
  Eigen::Matrix<float, 4, 4, Eigen::RowMajor> rows = to_camera;
  rows.row(3) << float(from.camera.fx), float(from.camera.fy), float(from.camera.cx),
      float(from.camera.cy);
  std::ofstream{folder / "view.f32", std::ios::binary}.write(
      reinterpret_cast<const char*>(rows.data()), sizeof(float) * 16);
  const auto write_bytes = [&](const char* name, const auto& bytes, index_t count) {
    std::ofstream{folder / name, std::ios::binary}.write(reinterpret_cast<const char*>(bytes),
                                                         std::streamsize(3 * count));
  };
  const auto& colors = all.layers()[0].content->points()[0].colors;
  write_bytes("large_colors.u8", colors.data(), colors.cols());
  const auto picture = render(all, from, {.blend = false});
  write_bytes("picture.u8", picture.pixels().data(), std::ssize(picture.pixels()));
}

/// One scan, one large cloud, and pairs of scans.
void write_tasks(const std::filesystem::path& folder) {
  pair_writer pairs{folder};
  write_simulated_pair(pairs);
  if (const auto frames = real / "rgbd/7scenes_1000"; std::filesystem::exists(frames))
    write_kinect_pairs(frames, pairs);
  if (const auto scans = real / "registration"; std::filesystem::exists(scans)) {
    write_bunny_pair(scans / "stanford_bunny_scans", pairs);
    write_lidar_pair(scans / "small_gicp", pairs);
  }
  write_bending_pairs(real / "mesh_nonrigid", folder);

  const auto depth_file = real / "rgbd/7scenes_1000/frame-000000.depth.png";
  const bool is_real = std::filesystem::exists(depth_file);
  const auto frame = [&]() -> point_cloud<float, 3> {
    if (is_real) return {.points = unproject(read_depth_png(depth_file), kinect)};
    const auto simulated = simulate(0, {.noise = 0.001});
    return cast<float>(
        point_cloud<double, 3>{.points = unproject(simulated.depth, simulated.camera)});
  }() | remove_invalid();
  write_floats(folder / "frame.f32", frame.points);
  std::cout << "frame: " << frame.size() << " points, " << (is_real ? "Kinect" : "simulated")
            << '\n';

  const auto depth = is_real ? read_depth_png(depth_file) : simulate(0, {.noise = 0.001}).depth;
  std::ofstream{folder / "depth.u16", std::ios::binary}.write(
      reinterpret_cast<const char*>(depth.pixels().data()),
      std::streamsize(depth.pixels().size() * 2));

  const auto large_file = real / "large/derived/7scenes_1cm_firstpoint.ply";
  if (std::filesystem::exists(large_file)) {
    std::filesystem::copy_file(large_file, folder / "large.ply",
                               std::filesystem::copy_options::overwrite_existing);
  } else {
    point_cloud<float, 3> large;
    for (int i = 0; i < 3; ++i)
      large = append(std::move(large), {.points = (frame.points.array() + float(i)).matrix()});
    large.colors = large.points.array() - large.points.array().floor();
    write_ply(large, folder / "large.ply");
  }
  const auto large = read_ply<float>(folder / "large.ply");
  write_pcd(large, folder / "large.pcd");
  write_las(large, folder / "large.las");
  write_pcd(large, folder / "large_compressed.pcd", {.format = pcd_format::binary_compressed});
  write_floats(folder / "large.f32", large.points);
  write_floats(folder / "large_normals.f32", estimate_normals(large.points, knn{30}).normals);
  write_picture_task(large, folder);
  write_text(point_cloud<float, 3>{.points = large.points}, folder / "large.xyz", {.names = false});
  std::cout << "large.ply and its like: " << large.size() << " points\n";
}

}  // namespace

int main(int count, char** arguments) {
  const std::string what = count == 3 ? arguments[1] : "";
  if (what == "tasks") {
    write_tasks(arguments[2]);
  } else if (what == "sizes") {
    write_sizes(arguments[2]);
  } else if (what == "sequence") {
    write_sequence(arguments[2]);
  } else if (what == "global") {
    write_global(arguments[2]);
  } else {
    std::cerr << "benchmark_data tasks|sizes|sequence|global FOLDER\n";
    return 1;
  }
  return 0;
}
