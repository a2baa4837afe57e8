// SPDX-License-Identifier: MIT
module;
#include <unordered_map>
module cilantro.tiles;

import cilantro.eigen;
import cilantro.numeric;
import cilantro.search;
import :communicator;
import :index_file;
import :cutting;
import :loading;
import :ranks;
import :region;
import :running;
import :survey;
import :tile_writer;
import :work_folder;

namespace cilantro {
namespace {

namespace fs = std::filesystem;

/// A point of the survey: its place in the order of the whole.
using point_number = std::uint64_t;
constexpr point_number nobody = std::numeric_limits<point_number>::max();

/// That a point is in the set which another one, the least in one tile, stands for.
struct membership {
  point_number point, set;
};
/// How many points of a tile are in a set, and the least of them.
struct set_part {
  point_number set, least, count;
};

/// What a tile knows about the sets of its points, without the other tiles.
struct tile_sets {
  std::vector<point_number> set_of_inside;  ///< Of the points of the tile, in their order.
  std::vector<membership> at_border;        ///< Of cores that other tiles see, too, or see first.
  std::vector<set_part> parts;
};

template <Scalar S, int D>
class tile_clustering {
 public:
  tile_clustering(const tile_survey<D>& survey, const cluster_rule& rule, const tile_info& tile,
                  const std::stop_token& stop)
      : survey_{survey},
        rule_{rule},
        tile_{tile},
        reach_{rule.radius * (1 + 1e-5) + survey.template slack<S>()},
        points_{
            load_region<S, D>(survey,
                              tile_region<D>{tile, survey.edge,
                                             (rule.min_points > 1 ? 2 : 1) * reach_, survey.bounds},
                              stop)},
        tree_{points_.cloud.points} {}

  tile_sets operator()() {
    const auto& cloud = points_.cloud;
    const index_t n = cloud.size();
    const tile_region<D> near{tile_, survey_.edge, reach_, survey_.bounds};
    const tile_region<D> deep{tile_, survey_.edge, -reach_, survey_.bounds};
    std::vector<std::uint8_t> is_near(n), is_inside(n), is_core(n);
    for (index_t i = 0; i < n; ++i) {
      is_near[i] = near.contains(place_of(i));
      is_inside[i] = is_in_tile(cloud, i, tile_, survey_.edge);
    }
    if (rule_.min_points > 1)
      visit(is_near, knn_in_radius{rule_.min_points, rule_.radius},
            [&](index_t i, auto near_i) { is_core[i] = std::ssize(near_i) == rule_.min_points; });
    else
      is_core = is_near;

    disjoint_sets sets{n};
    visit(is_core, radius{rule_.radius}, [&](index_t i, auto near_i) {
      for (const auto& [j, distance] : near_i)
        if (is_core[j] != 0) sets.join(i, j);
    });
    std::vector<point_number> set_of(n, nobody);
    std::vector<std::uint8_t> is_other(n);
    for (index_t i = 0; i < n; ++i) {
      // Sets are represented by their first point, which is that of the least number.
      if (is_core[i] != 0) set_of[i] = points_.order[sets.find(i)];
      is_other[i] = is_inside[i] != 0 && is_core[i] == 0;
    }
    if (rule_.min_points > 1)
      visit(is_other, radius{rule_.radius}, [&](index_t i, auto near_i) {
        const auto nearest = std::ranges::find_if(
            near_i, [&](const auto& found) { return is_core[found.index] != 0; });
        if (nearest != near_i.end()) set_of[i] = points_.order[sets.find((*nearest).index)];
      });

    tile_sets found;
    std::unordered_map<point_number, set_part> parts;
    for (index_t i = 0; i < n; ++i) {
      const bool others_see = is_inside[i] == 0 || !deep.contains(place_of(i));
      if (is_core[i] != 0 && others_see) found.at_border.push_back({points_.order[i], set_of[i]});
      if (is_inside[i] == 0) continue;
      found.set_of_inside.push_back(set_of[i]);
      if (set_of[i] == nobody) continue;
      // The first that is met has the least number.
      auto& part =
          parts.try_emplace(set_of[i], set_part{set_of[i], points_.order[i], 0}).first->second;
      ++part.count;
    }
    for (const auto& [set, part] : parts) found.parts.push_back(part);
    return found;
  }

 private:
  [[nodiscard]] point_vector<double, D> place_of(index_t i) const {
    return world_of<S, D>(points_.cloud.points.col(i), survey_.origin);
  }
  template <class F>
  void visit(std::span<const std::uint8_t> wanted, const neighborhood_spec& spec, F f) {
    visit_neighborhoods(tree_, points_.cloud.points, spec,
                        [&](const neighborhood_block<S>& block) {
                          for (index_t q = 0; q < block.size(); ++q) f(block.query(q), block[q]);
                        },
                        {.wanted = wanted});
  }

  const tile_survey<D>& survey_;
  const cluster_rule& rule_;
  const tile_info& tile_;
  double reach_;
  loaded_points<S, D> points_;
  kd_tree<S, D> tree_;
};

/// Which sets are one, over all tiles, and the numbers of those that are clusters.
class joined_sets {
 public:
  void join(std::span<const membership> known) {
    for (const auto& [point, set] : known) {
      const auto a = find(point), b = find(set);
      if (a != b) parents_[std::max(a, b)] = std::min(a, b);
    }
  }
  void add(std::span<const set_part> parts) {
    for (const auto& part : parts) {
      auto& whole = wholes_.try_emplace(find(part.set), set_part{0, nobody, 0}).first->second;
      whole.least = std::min(whole.least, part.least);
      whole.count += part.count;
    }
  }
  /// The largest first, of equally large ones the one with the least point.
  void number(const cluster_rule& rule) {
    std::vector<std::tuple<point_number, point_number, point_number>> order;
    for (const auto& [set, whole] : wholes_)
      if (static_cast<point_number>(rule.least) <= whole.count &&
          whole.count <= static_cast<point_number>(rule.most))
        order.emplace_back(nobody - whole.count, whole.least, set);
    expects(order.size() <= std::size_t{std::numeric_limits<std::int32_t>::max()},
            "write_clusters: there are more than 2^31 - 1 clusters");
    std::ranges::sort(order);
    for (std::size_t i = 0; i < order.size(); ++i)
      numbers_[std::get<2>(order[i])] = static_cast<std::int32_t>(i);
    for (auto& [point, parent] : parents_) parent = find(point);
  }
  /// After `number`. May be called by several threads at once.
  [[nodiscard]] std::int32_t number_of(point_number set) const {
    if (set == nobody) return clusters::none;
    const auto known = parents_.find(set);
    const auto found = numbers_.find(known == parents_.end() ? set : known->second);
    return found == numbers_.end() ? clusters::none : found->second;
  }

 private:
  point_number find(point_number i) {
    auto at = parents_.try_emplace(i, i).first;
    while (at->second != at->first) {
      const auto above = parents_.find(at->second);
      at->second = above->second;
      at = parents_.find(at->second);
    }
    return at->first;
  }

  std::unordered_map<point_number, point_number> parents_;
  std::unordered_map<point_number, set_part> wholes_;
  std::unordered_map<point_number, std::int32_t> numbers_;
};

/// Where the sets of the points of a tile have been put aside.
struct labels_place {
  std::int64_t tile = 0, rank = 0;
  std::uint64_t at = 0, count = 0;
};

/// The clusters of a cloud without steps.
template <Scalar S, int D>
class cluster_writer {
 public:
  cluster_writer(const tiled_cloud<S, D>& cloud, const fs::path& folder, const cluster_rule& rule,
                 const task_monitor& monitor)
      : cloud_{cloud},
        survey_{*cloud.survey()},
        ranks_{cloud.ranks().get()},
        folder_{folder},
        rule_{rule},
        monitor_{monitor},
        scratch_(ranks_ ? ranks_->size : 1) {}

  void write(const std::string& what, const write_tiles_options& options) {
    find_sets();
    tile_writer<S, D> writer{cloud_, folder_, what, false, options, monitor_};
    writer.write([&](index_t t) { return labelled(t); });
  }

 private:
  [[nodiscard]] fs::path scratch_of(int rank) const {
    return folder_ / ("labels-" + std::to_string(rank) + std::string{sets_ending});
  }

  void find_sets() {
    const int me = ranks_ ? ranks_->rank : 0;
    std::vector<membership> at_border;
    std::vector<set_part> parts;
    std::vector<labels_place> places;
    std::mutex mutex;
    on_all_ranks(ranks_, [&] {
      scratch_[me] = std::make_unique<scratch_file>(scratch_of(me), true);
      const std::vector<tile_step<S, D>> reach{{"write_clusters", {.distance = 2 * rule_.radius}}};
      run_all<D>(
          survey_, ranks_, all_tiles(survey_), survey_.threads,
          [&](index_t t) { return memory_of<S, D>(survey_, reach, survey_.tiles[t], 0); },
          [&](index_t t) {
            const auto found =
                tile_clustering<S, D>{survey_, rule_, survey_.tiles[t], monitor_.stop}();
            const std::scoped_lock lock{mutex};
            places.push_back({t, me, scratch_[me]->size(), found.set_of_inside.size()});
            scratch_[me]->append(found.set_of_inside.data(),
                                 found.set_of_inside.size() * sizeof(point_number));
            at_border.insert(at_border.end(), found.at_border.begin(), found.at_border.end());
            parts.insert(parts.end(), found.parts.begin(), found.parts.end());
          },
          monitor_);
    });
    sets_.join(gather_all(ranks_, at_border));
    sets_.add(gather_all(ranks_, parts));
    sets_.number(rule_);
    for (const auto& place : gather_all(ranks_, places)) places_[place.tile] = place;
    on_all_ranks(ranks_, [&] {
      for (std::size_t r = 0; r < scratch_.size(); ++r)
        if (!scratch_[r])
          scratch_[r] = std::make_unique<scratch_file>(scratch_of(static_cast<int>(r)), false);
    });
  }

  point_cloud<S, D> labelled(index_t t) {
    auto points = run_tile<S, D>(survey_, {}, survey_.tiles[t], 0, monitor_.stop);
    const auto place = places_.at(t);
    std::vector<point_number> sets(place.count);
    scratch_[place.rank]->read(place.at, sets.data(), sets.size() * sizeof(point_number));
    std::vector<std::int32_t> numbers;
    numbers.reserve(sets.size());
    for (const auto set : sets) numbers.push_back(sets_.number_of(set));
    points.set_attribute("cluster", attribute_values{std::move(numbers)});
    return points;
  }

  const tiled_cloud<S, D>& cloud_;
  const tile_survey<D>& survey_;
  const process_group* ranks_;
  fs::path folder_;
  const cluster_rule& rule_;
  const task_monitor& monitor_;
  std::vector<std::unique_ptr<scratch_file>> scratch_;  ///< By rank.
  std::map<std::int64_t, labels_place> places_;         ///< By tile.
  joined_sets sets_;
};

void expect_of_tiles(int threads, const task_monitor& monitor) {
  expects(!monitor.progress && !monitor.stop.stop_possible(),
          "write_clusters: .monitor is an option of the tiles, which come last");
  expects(threads == 0, "write_clusters: .threads are those of open_tiles");
}

}  // namespace

cluster_rule rule_of(radius distance, const components_options& components) {
  expects(!components.seeds, "write_clusters: seeds are indices of one cloud, which tiles are not");
  expects(distance.distance > 0 && distance.distance < 1e300,
          "write_clusters: the distance must be positive and finite");
  expect_of_tiles(components.threads, components.monitor);
  expect_from(0, double(components.min_cluster_size), "write_clusters: min_cluster_size");
  expect_from(0, double(components.max_cluster_size), "write_clusters: max_cluster_size");
  return {distance.distance, 1, components.min_cluster_size, components.max_cluster_size};
}

cluster_rule rule_of(const dbscan_options& dbscan) {
  expect_of_tiles(dbscan.threads, dbscan.monitor);
  expect_from(1, double(dbscan.min_points), "write_clusters: min_points");
  // Where one point is enough, all are cores, as those of components are.
  return {dbscan.radius, dbscan.min_points, 1, std::numeric_limits<index_t>::max()};
}

template <Scalar S, int D>
tiled_cloud<S, D> write_clusters_by(const tiled_cloud<S, D>& cloud, const fs::path& folder,
                                    const cluster_rule& rule, const write_tiles_options& options) {
  const auto& ranks = cloud.ranks();
  const std::string what = description_of(cloud, options) + ", clusters within " +
                           in_digits(rule.radius) + " of " + std::to_string(rule.min_points) +
                           ", " + std::to_string(rule.least) + " to " + std::to_string(rule.most);
  expect_same(ranks.get(), what);
  const auto& survey = *cloud.survey();
  const tile_options how{.memory = survey.memory, .threads = survey.threads};
  if (options.resume && is_complete<D>(ranks.get(), folder, what))
    return opened_by_all<S, D>(folder, how, ranks);
  std::unique_ptr<folder_lock> lock;
  on_first_rank(ranks.get(), [&] {
    lock = make_folder(folder, options.resume);
    const tile_notes<D> begun{folder, what, 0};
  });
  const auto monitor = in_passes(options.monitor, cloud.steps().empty() ? 2 : 3);
  auto from = cloud;
  if (!cloud.steps().empty())
    from = write_tiles_as(cloud, points_folder(folder), true,
                          {.format = options.format, .resume = true, .monitor = monitor});
  cluster_writer<S, D>{from, folder, rule, monitor}.write(what, options);
  on_first_rank(ranks.get(), [&] { remove_leftovers(folder); });
  return opened_by_all<S, D>(folder, how, ranks);
}

#define CILANTRO_INSTANTIATE(S, D)                                                        \
  template tiled_cloud<S, D> write_clusters_by(const tiled_cloud<S, D>&, const fs::path&, \
                                               const cluster_rule&, const write_tiles_options&);
CILANTRO_INSTANTIATE(float, 2)
CILANTRO_INSTANTIATE(float, 3)
CILANTRO_INSTANTIATE(double, 2)
CILANTRO_INSTANTIATE(double, 3)
#undef CILANTRO_INSTANTIATE

}  // namespace cilantro
