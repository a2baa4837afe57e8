// SPDX-License-Identifier: MIT
#include "mpi_backend.hpp"

#include <mpi.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <iterator>
#include <mutex>
#include <string>
#include <thread>
#include <utility>

namespace cilantro::mpi::detail {
namespace {

using namespace std::chrono_literals;
using clock = std::chrono::steady_clock;

/// What all ranks must call together.
enum class together : std::int64_t { all_gather, deal, end };
const char* name_of(std::int64_t call) {
  return std::array{"calls all_gather", "calls deal", "ends its communicator"}.at(
      static_cast<std::size_t>(call));
}

/// What threads of ranks tell each other.
enum class word : std::int64_t { question, here, bye };
struct message {
  std::int64_t what, value;
};
constexpr int tag_of_words = 1, tag_of_answers = 2, fields = 2;

struct outgoing {
  MPI_Request request = MPI_REQUEST_NULL;
  message content = {};
};

/// Pieces of all ranks that are gathered at once take no more bytes than this.
constexpr std::int64_t gathered_at_once = std::int64_t{1} << 26;

/// Waits longer each time, up to a millisecond: who is answered at once loses little, and who waits
/// long takes no time from those that compute.
class growing_pause {
 public:
  void operator()() {
    if (++turns_ < 20) return std::this_thread::yield();
    std::this_thread::sleep_for(std::min<clock::duration>(1ms, turns_ * 2us));
  }

 private:
  int turns_ = 0;
};

}  // namespace

class session::job {
 public:
  job(int& argc, char**& argv, double patience);

  [[nodiscard]] int rank() const { return rank_; }
  [[nodiscard]] int size() const { return size_; }
  std::vector<std::vector<std::byte>> all_gather(std::span<const std::byte> mine);
  void deal(std::ptrdiff_t count);
  std::optional<std::ptrdiff_t> next_ticket();

  /// Ends this rank's part when all others end theirs.
  void finish();
  /// Ends all ranks soon: after what handles an exception has had time to say more.
  void leave();
  /// Ends all ranks at once; `sentence` goes on after the name of this one.
  [[noreturn]] void end(const std::string& sentence);

  [[nodiscard]] bool is_left() const { return std::uncaught_exceptions() > exceptions_; }

  static job* current();
  static void at_exit();
  static void on_terminate();

 private:
  template <class F>
  void call(const char* name, F&& f) {
    const std::lock_guard lock{mpi_};
    if (const int code = f(); code != MPI_SUCCESS) {
      std::array<char, MPI_MAX_ERROR_STRING> text;
      int length = 0;
      MPI_Error_string(code, text.data(), &length);
      throw failure{"rank " + std::to_string(rank_) + ": " + name + ": " +
                    std::string{text.data(), static_cast<std::size_t>(length)}};
    }
  }
  bool is_done(MPI_Request& request) {
    int done = 0;
    call("MPI_Test", [&] { return MPI_Test(&request, &done, MPI_STATUS_IGNORE); });
    return done != 0;
  }
  void wait(MPI_Request& request) {
    for (growing_pause pause; !is_done(request);) pause();
  }
  std::vector<std::int64_t> agree(together what, std::int64_t value);

  void say(const std::string& sentence) const;
  [[noreturn]] void abort();

  // What the thread that answers for this rank does, in turns.
  void serve();
  void serve_until_all_end();
  void listen();
  void answer_questions();
  void tell(int to, word what);
  void miss_who_is_silent();
  std::int64_t take_ticket();

  MPI_Comm ranks_ = MPI_COMM_NULL;
  int rank_ = 0, size_ = 1;
  bool started_here_ = false;
  int exceptions_ = std::uncaught_exceptions();
  std::string machine_;
  std::terminate_handler terminate_before_ = nullptr;

  std::timed_mutex mpi_;  // One thread calls MPI at a time.
  std::atomic<bool> ending_ = false, closing_ = false, left_ = false;

  std::mutex asking_, tickets_;  // Held in this order.
  std::int64_t round_ = 0, next_ = 0, count_ = 0;
  bool all_taken_ = true;

  std::thread service_;
  clock::duration patience_, period_;
  clock::time_point last_turn_ = clock::now(), last_told_ = last_turn_;
  std::vector<clock::time_point> heard_;
  std::vector<std::pair<int, std::int64_t>> questions_;  // Who asks, and in which round.
  std::vector<outgoing> words_, answers_;                // One underway to each rank.
  std::vector<char> bye_said_, bye_heard_;
};

namespace {

std::atomic<session::job*> the_job = nullptr;

}  // namespace

session::job* session::job::current() {
  return the_job;
}

session::job::job(int& argc, char**& argv, double patience)
    : patience_{std::chrono::duration_cast<clock::duration>(
          std::chrono::duration<double>{std::min(patience, 1e9)})},
      period_{std::min<clock::duration>(1s, patience_ / 4)} {
  int started = 0, ended = 0, level = 0;
  call("MPI_Initialized", [&] { return MPI_Initialized(&started); });
  call("MPI_Finalized", [&] { return MPI_Finalized(&ended); });
  if (ended) throw failure{"MPI has ended in this process, and cannot start again"};
  if (started) {
    call("MPI_Query_thread", [&] { return MPI_Query_thread(&level); });
  } else {
    call("MPI_Init_thread",
         [&] { return MPI_Init_thread(&argc, &argv, MPI_THREAD_SERIALIZED, &level); });
    started_here_ = true;
  }
  if (level < MPI_THREAD_SERIALIZED)
    throw failure{
        "this MPI, or how it was started, allows no second thread to call it: "
        "MPI_THREAD_SERIALIZED is needed"};
  call("MPI_Comm_dup", [&] { return MPI_Comm_dup(MPI_COMM_WORLD, &ranks_); });
  MPI_Comm_set_errhandler(ranks_, MPI_ERRORS_RETURN);
  MPI_Comm_rank(ranks_, &rank_);
  MPI_Comm_size(ranks_, &size_);
  std::array<char, MPI_MAX_PROCESSOR_NAME> name;
  int length = 0;
  MPI_Get_processor_name(name.data(), &length);
  machine_.assign(name.data(), static_cast<std::size_t>(length));

  const auto ranks = static_cast<std::size_t>(size_);
  heard_.assign(ranks, clock::now());
  words_.resize(ranks);
  answers_.resize(ranks);
  bye_said_.resize(ranks);
  bye_heard_.resize(ranks);
  the_job = this;
  terminate_before_ = std::set_terminate(on_terminate);
  static const int registered = std::atexit(at_exit);
  (void)registered;
  if (size_ > 1) service_ = std::thread{[this] { serve(); }};
}

// ---- Ends, good and bad -------------------------------------------------------------------------

void session::job::finish() {
  (void)agree(together::end, 0);
  closing_ = true;
  if (service_.joinable()) service_.join();
  std::set_terminate(terminate_before_);
  the_job = nullptr;
  call("MPI_Comm_free", [&] { return MPI_Comm_free(&ranks_); });
  if (started_here_) call("MPI_Finalize", [] { return MPI_Finalize(); });
}

void session::job::say(const std::string& sentence) const {
  const std::string line = "cilantro: rank " + std::to_string(rank_) + " of " +
                           std::to_string(size_) + ", on " + machine_ + ", " + sentence +
                           "; the job ends\n";
  std::fputs(line.c_str(), stderr);
  std::fflush(stderr);
}

void session::job::abort() {
  // Another thread may be in the middle of it, or MPI itself wait for what is lost.
  std::thread{[] {
    std::this_thread::sleep_for(5s);
    std::_Exit(1);
  }}.detach();
  while (ending_.exchange(true)) std::this_thread::sleep_for(1s);
  (void)mpi_.try_lock_for(1s);
  MPI_Abort(MPI_COMM_WORLD, 1);
  std::_Exit(1);
}

void session::job::end(const std::string& sentence) {
  say(sentence);
  abort();
}

void session::job::leave() {
  left_ = true;
  say("is left by an exception");
  std::thread{[this] {
    std::this_thread::sleep_for(2s);
    abort();
  }}.detach();
}

void session::job::at_exit() {
  // While the job is there, `exit` was called below it, or an exception has passed it.
  if (job* const now = current(); now && !now->ending_) {
    if (!now->left_) now->say("has ended before the others");
    now->abort();
  }
}

void session::job::on_terminate() {
  std::string sentence = "has come to std::terminate";
  try {
    if (const auto what = std::current_exception()) {
      sentence = "ends by an exception";
      std::rethrow_exception(what);
    }
  } catch (const std::exception& what) {
    sentence += std::string{": "} + what.what();
  } catch (...) {
    sentence += " of an unknown type";
  }
  current()->end(sentence);
}

// ---- What all ranks call together ---------------------------------------------------------------

std::vector<std::int64_t> session::job::agree(together what, std::int64_t value) {
  const message mine{static_cast<std::int64_t>(what), value};
  std::vector<message> all(static_cast<std::size_t>(size_));
  MPI_Request request;
  call("MPI_Iallgather", [&] {
    return MPI_Iallgather(&mine, fields, MPI_INT64_T, all.data(), fields, MPI_INT64_T, ranks_,
                          &request);
  });
  wait(request);
  std::vector<std::int64_t> values;
  for (std::size_t other = 0; other < all.size(); ++other) {
    if (all[other].what != mine.what)
      throw failure{"rank " + std::to_string(rank_) + " " + name_of(mine.what) + ", but rank " +
                    std::to_string(other) + " " + name_of(all[other].what)};
    values.push_back(all[other].value);
  }
  return values;
}

std::vector<std::vector<std::byte>> session::job::all_gather(std::span<const std::byte> mine) {
  const auto sizes = agree(together::all_gather, std::ssize(mine));
  std::vector<std::vector<std::byte>> all(sizes.size());
  for (std::size_t r = 0; r < all.size(); ++r) all[r].resize(static_cast<std::size_t>(sizes[r]));
  // Counts and places are an int each, so large ones go in pieces.
  const std::int64_t most = std::max<std::int64_t>(1, gathered_at_once / size_);
  std::vector<std::byte> together;
  std::vector<int> counts(sizes.size()), places(sizes.size());
  for (std::int64_t begin = 0; begin < std::ranges::max(sizes); begin += most) {
    int place = 0;
    for (std::size_t r = 0; r < sizes.size(); ++r) {
      counts[r] = static_cast<int>(std::clamp<std::int64_t>(sizes[r] - begin, 0, most));
      places[r] = place;
      place += counts[r];
    }
    together.resize(static_cast<std::size_t>(place));
    const int count = counts[static_cast<std::size_t>(rank_)];
    const std::byte* const piece = count > 0 ? mine.data() + begin : nullptr;
    MPI_Request request;
    call("MPI_Iallgatherv", [&] {
      return MPI_Iallgatherv(piece, count, MPI_BYTE, together.data(), counts.data(), places.data(),
                             MPI_BYTE, ranks_, &request);
    });
    wait(request);
    for (std::size_t r = 0; r < sizes.size(); ++r)
      std::copy_n(together.begin() + places[r], counts[r],
                  all[r].begin() + (counts[r] ? begin : 0));
  }
  return all;
}

void session::job::deal(std::ptrdiff_t count) {
  const auto counts = agree(together::deal, count);
  for (std::size_t other = 0; other < counts.size(); ++other)
    if (counts[other] != count)
      throw failure{"rank " + std::to_string(rank_) + " deals " + std::to_string(count) +
                    " tickets, but rank " + std::to_string(other) + " " +
                    std::to_string(counts[other])};
  const std::lock_guard lock{tickets_};
  ++round_;
  next_ = 0;
  count_ = count;
  all_taken_ = false;
}

// ---- Dealing ------------------------------------------------------------------------------------

/// For rank 0, which has the tickets; -1 without any.
std::int64_t session::job::take_ticket() {
  return next_ < count_ ? next_++ : -1;
}

std::optional<std::ptrdiff_t> session::job::next_ticket() {
  const std::lock_guard one_at_a_time{asking_};
  message question{static_cast<std::int64_t>(word::question), 0}, answer{};
  {
    const std::lock_guard lock{tickets_};
    if (all_taken_) return {};
    question.value = round_;
    if (rank_ == 0) answer.value = take_ticket();
  }
  if (rank_ != 0) {
    MPI_Request asked, answered;
    call("MPI_Irecv", [&] {
      return MPI_Irecv(&answer, fields, MPI_INT64_T, 0, tag_of_answers, ranks_, &answered);
    });
    call("MPI_Isend", [&] {
      return MPI_Isend(&question, fields, MPI_INT64_T, 0, tag_of_words, ranks_, &asked);
    });
    wait(asked);
    wait(answered);
  }
  if (answer.value >= 0) return answer.value;
  const std::lock_guard lock{tickets_};
  all_taken_ = round_ == question.value;
  return {};
}

void session::job::answer_questions() {
  const std::lock_guard lock{tickets_};
  std::erase_if(questions_, [&](const auto& question) {
    const auto [from, round] = question;
    // Who has left `deal` before this rank asks too early.
    if (round > round_) return false;
    outgoing& answer = answers_[static_cast<std::size_t>(from)];
    wait(answer.request);  // It has been received: they would not ask again without.
    answer.content = {round, round == round_ ? take_ticket() : -1};
    call("MPI_Isend", [&] {
      return MPI_Isend(&answer.content, fields, MPI_INT64_T, from, tag_of_answers, ranks_,
                       &answer.request);
    });
    return true;
  });
}

// ---- The thread that answers for this rank ------------------------------------------------------

void session::job::serve() {
  try {
    serve_until_all_end();
  } catch (const std::exception& what) {
    end(std::string{"cannot speak to the others: "} + what.what());
  }
}

// Rank 0 and each other rank hear of each other; the others among themselves do not.
void session::job::serve_until_all_end() {
  const int begin = rank_ == 0 ? 1 : 0, stop = rank_ == 0 ? size_ : 1;
  for (;;) {
    listen();
    if (rank_ == 0) answer_questions();
    const auto now = clock::now();
    const bool ends = closing_;
    if (ends || (patience_ > 0s && now - last_told_ >= period_)) {
      for (int to = begin; to < stop; ++to) tell(to, ends ? word::bye : word::here);
      last_told_ = now;
    }
    if (patience_ > 0s) miss_who_is_silent();
    bool all_done = true;
    for (int other = begin; other < stop; ++other) {
      const auto o = static_cast<std::size_t>(other);
      all_done = all_done && bye_said_[o] && bye_heard_[o] && is_done(words_[o].request) &&
                 is_done(answers_[o].request);
    }
    if (all_done) return;
    std::this_thread::sleep_for(1ms);
  }
}

void session::job::listen() {
  for (;;) {
    int there = 0;
    MPI_Status status;
    message heard{};
    call("MPI_Iprobe", [&] {
      const int code = MPI_Iprobe(MPI_ANY_SOURCE, tag_of_words, ranks_, &there, &status);
      if (code != MPI_SUCCESS || !there) return code;
      return MPI_Recv(&heard, fields, MPI_INT64_T, status.MPI_SOURCE, tag_of_words, ranks_,
                      MPI_STATUS_IGNORE);
    });
    if (!there) return;
    const auto from = static_cast<std::size_t>(status.MPI_SOURCE);
    heard_[from] = clock::now();
    if (heard.what == static_cast<std::int64_t>(word::question))
      questions_.emplace_back(status.MPI_SOURCE, heard.value);
    if (heard.what == static_cast<std::int64_t>(word::bye)) bye_heard_[from] = 1;
  }
}

void session::job::tell(int to, word what) {
  const auto t = static_cast<std::size_t>(to);
  // Where nothing gets through, no more is sent.
  if (bye_said_[t] || !is_done(words_[t].request)) return;
  words_[t].content = {static_cast<std::int64_t>(what), 0};
  call("MPI_Isend", [&] {
    return MPI_Isend(&words_[t].content, fields, MPI_INT64_T, to, tag_of_words, ranks_,
                     &words_[t].request);
  });
  bye_said_[t] = what == word::bye ? 1 : 0;
}

void session::job::miss_who_is_silent() {
  const auto now = clock::now();
  // After a sleep of this process, the others have been silent for it only.
  if (now - last_turn_ > period_) std::ranges::fill(heard_, now);
  last_turn_ = now;
  for (int other = 0; other < (rank_ == 0 ? size_ : 1); ++other) {
    const auto o = static_cast<std::size_t>(other);
    if (other == rank_ || bye_heard_[o] || now - heard_[o] <= patience_) continue;
    const auto seconds = std::chrono::duration<double>(patience_).count();
    std::array<char, 32> digits;
    std::snprintf(digits.data(), digits.size(), "%g", seconds);
    end("has not heard of rank " + std::to_string(other) + " for " + digits.data() +
        " seconds: it, its machine or the network between is lost");
  }
}

// ---- The session --------------------------------------------------------------------------------

session::session(int& argc, char**& argv, double patience)
    : job_{std::make_unique<job>(argc, argv, patience)} {}

session::~session() {
  if (job_->is_left()) {
    job_.release()->leave();
    return;
  }
  try {
    job_->finish();
  } catch (const std::exception& what) {
    job_->end(std::string{"cannot end with the others: "} + what.what());
  }
}

bool session::exists() {
  return job::current() != nullptr;
}
int session::rank() const {
  return job_->rank();
}
int session::size() const {
  return job_->size();
}
std::vector<std::vector<std::byte>> session::all_gather(std::span<const std::byte> mine) {
  return job_->all_gather(mine);
}
void session::deal(std::ptrdiff_t count) {
  job_->deal(count);
}
std::optional<std::ptrdiff_t> session::next_ticket() {
  return job_->next_ticket();
}

}  // namespace cilantro::mpi::detail
