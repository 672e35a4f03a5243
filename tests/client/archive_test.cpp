// Policy: an archive has everything that judging needs, and equal archives have equal bytes. A damaged, newer, foreign
// or contradictory file is refused with its cause. Claims of an archive are never trusted: its solutions are judged
// again.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "client/archive/archive_file.h"
#include "client/archive/archive_pack.h"
#include "command_line_fixture.h"
#include "legopt/input/json.h"
#include "legopt/math/blake2b.h"
#include "legopt/types/input_error.h"

namespace legopt::client {
namespace {

using testing::AllOf;
using testing::AnyOf;
using testing::HasSubstr;
using testing::Not;

Archive Sample() {
  Archive archive;
  archive.about.title = "A \"sample\"";
  archive.about.authors = {"Ä", "B"};
  archive.experiment = "quick";
  archive.dataset = "garage";
  archive.dataset_hash = std::string(64, 'd');
  archive.seed = 7;
  archive.repetitions = 2;
  archive.tasks = {{Task::kPosture, {0, 3}}};
  archive.initializations = {Initialization::kGood};
  archive.methods = {{"SQP", Blake2bHex("{}"), "{}", 10, 80}};
  archive.builds = {{"0123456789ab", "legopt 1", "a processor"}};
  ArchivedResult result;
  result.problem = 3;
  result.repetition = 1;
  result.cpu_us = 1500;
  result.work_ns = 1'234'567;
  result.evaluations = 99;
  result.status = SolveStatus::kIterationLimit;
  result.starts = 3;
  result.solver_violation = 1e-300;
  result.margin_relaxed = 0.1;
  result.verdicts[Rule::kLiteral] = Verdict::kSuccess;
  result.cost = 0.1 + 0.2;
  result.waypoints = {Eigen::Vector3d(1.0 / 3.0, -0.0, std::numeric_limits<double>::quiet_NaN())};
  archive.results = {result};
  return archive;
}

std::string FaultOf(const std::string& bytes) {
  try {
    DecodeArchive(bytes, "a.legopt-archive");
  } catch (const InputError& error) {
    return error.what();
  }
  return "no error";
}

TEST(ArchiveFile, KeepsEveryBit) {
  const std::string bytes = EncodeArchive(Sample());
  const Archive read = DecodeArchive(bytes, "a");
  EXPECT_EQ(EncodeArchive(read), bytes);
  EXPECT_EQ(read.num_jobs(), 4);
  EXPECT_EQ(read.about.authors[0], "Ä");
  EXPECT_EQ(read.methods[0].multi_starts, 10);
  ASSERT_EQ(read.results.size(), 1U);
  EXPECT_EQ(read.results[0].cost, 0.1 + 0.2);
  EXPECT_EQ(read.results[0].waypoints[0][0], 1.0 / 3.0);
  EXPECT_TRUE(std::signbit(read.results[0].waypoints[0][1]));
  EXPECT_TRUE(std::isnan(read.results[0].waypoints[0][2]));
  EXPECT_FALSE(read.results[0].verdicts[Rule::kSolid].has_value());
}

TEST(ArchiveFile, EveryFlippedBitIsFound) {
  const std::string bytes = EncodeArchive(Sample());
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    std::string flipped = bytes;
    flipped[i] = static_cast<char>(flipped[i] ^ 1);
    EXPECT_NE(FaultOf(flipped), "no error") << "byte " << i;
  }
  for (std::size_t length = 0; length < bytes.size(); ++length) {
    EXPECT_NE(FaultOf(bytes.substr(0, length)), "no error") << length << " bytes";
  }
}

TEST(ArchiveFile, AnotherFileAndANewerFormatAreNamed) {
  EXPECT_THAT(FaultOf("SQLite format 3"), HasSubstr("is no archive of legopt"));
  std::string newer = EncodeArchive(Sample());
  newer.replace(newer.find(" 1 "), 3, " 2 ");
  std::string nonsense = EncodeArchive(Sample());
  nonsense.replace(nonsense.find(" 1 "), 3, " 0 ");
  EXPECT_THAT(FaultOf(nonsense), HasSubstr("is no format of archives"));
  EXPECT_THAT(FaultOf(newer), AllOf(HasSubstr("newer than this legopt, which reads format 1"), HasSubstr("'2'")));
}

// The writer checks nothing, so it can make every contradiction.
std::string FaultWith(const std::function<void(Archive*)>& change) {
  Archive archive = Sample();
  change(&archive);
  return FaultOf(EncodeArchive(archive));
}

TEST(ArchiveFile, ContradictionsAreNamed) {
  EXPECT_THAT(FaultWith([](Archive* a) { a->results.push_back(a->results[0]); }),
              AllOf(HasSubstr("is of the same job as result 1"), HasSubstr("SQP, posture 3, good, repetition 1")));
  EXPECT_THAT(FaultWith([](Archive* a) { a->builds[0].id.clear(); }),
              HasSubstr("builds.id: is empty: the results are of an unknown build and cannot be reproduced"));
  EXPECT_THAT(FaultWith([](Archive* a) { a->results[0].build = 1; }),
              HasSubstr("build: must be a whole number from 0 to 0"));
  EXPECT_THAT(FaultWith([](Archive* a) { a->results[0].method = 5; }),
              HasSubstr("method: must be a whole number from 0 to 0"));
  EXPECT_THAT(FaultWith([](Archive* a) { a->results[0].problem = 1; }),
              HasSubstr("is not among the problems of the experiment (got '1')"));
  EXPECT_THAT(FaultWith([](Archive* a) { a->results[0].repetition = 2; }),
              HasSubstr("repetition: must be a whole number from 0 to 1"));
  EXPECT_THAT(FaultWith([](Archive* a) { a->initializations = {Initialization::kInCollision}; }),
              HasSubstr("is not among those of the experiment"));
  EXPECT_THAT(FaultWith([](Archive* a) { a->tasks[0].problems = {3, 3}; }), HasSubstr("must be ascending"));
  EXPECT_THAT(FaultWith([](Archive* a) { a->dataset_hash = "x"; }), HasSubstr("dataset_hash: must have 64 hex digits"));
  EXPECT_THAT(FaultWith([](Archive* a) { a->methods.clear(); }), HasSubstr("methods: is empty"));
  EXPECT_THAT(FaultWith([](Archive* a) { a->tasks.push_back(a->tasks[0]); }), HasSubstr("names a task twice"));
  EXPECT_THAT(FaultWith([](Archive* a) { a->initializations.push_back(a->initializations[0]); }),
              HasSubstr("names one twice"));
  EXPECT_THAT(FaultWith([](Archive* a) { a->methods.resize(1001, a->methods[0]); }),
              HasSubstr("more than 1000 methods"));
  EXPECT_THAT(FaultWith([](Archive* a) {
                a->repetitions = 100'000;
                a->methods.resize(10, a->methods[0]);
                for (ArchivedMethod& method : a->methods)
                  method.name = "SQP " + std::to_string(&method - &a->methods[0]);
              }),
              HasSubstr("more than 1000000 jobs"));
  EXPECT_THAT(FaultWith([](Archive* a) { a->results[0].waypoints.resize(100'001, Eigen::Vector3d::Zero()); }),
              HasSubstr("more than 100000 waypoints"));
  EXPECT_THAT(FaultWith([](Archive* a) { a->methods.push_back(a->methods[0]); }),
              HasSubstr("methods: names one twice"));
  EXPECT_THAT(FaultWith([](Archive* a) { a->methods[0].options = "{\"solver\":\"best\"}"; }),
              HasSubstr("hash: is not that of the options"));
  EXPECT_THAT(FaultWith([](Archive* a) { a->methods[0].options = "[]"; }), HasSubstr("is not that of the options"));
  const auto with_options = [](const std::string& options) {
    return FaultWith([&](Archive* a) {
      a->methods[0].options = options;
      a->methods[0].hash = Blake2bHex(options);
    });
  };
  EXPECT_EQ(with_options("{\"multi_starts\":10,\"sample_size\":80}"), "no error");
  EXPECT_THAT(with_options("{\"multi_starts\":9}"), HasSubstr("has a wrong value of 'multi_starts'"));
  EXPECT_THAT(with_options("{\"sample_size\":100}"), HasSubstr("has a wrong value of 'sample_size'"));
  EXPECT_THAT(with_options("{\"incremental\":\"yes\"}"), HasSubstr("has a wrong value of 'incremental'"));
  EXPECT_THAT(with_options("{\"options\":3}"), HasSubstr("has a wrong value of 'options'"));
  EXPECT_THAT(with_options("{\"options\":{\"rescues\":\"abc\"}}"), HasSubstr("has a wrong value of 'rescues'"));
  EXPECT_THAT(with_options("{\"options\":{\"collision\":\"air\"}}"), HasSubstr("has a wrong value of 'collision'"));
  EXPECT_THAT(FaultWith([](Archive* a) { a->builds[0].id = std::string(65, 'a'); }), HasSubstr("at most 64 bytes"));
  EXPECT_THAT(FaultWith([](Archive* a) { a->builds[0].id = std::string(1, '\0'); }), HasSubstr("has a NUL character"));
  EXPECT_THAT(FaultWith([](Archive* a) { a->tasks.push_back({Task::kMotion, {}}); }), HasSubstr("problems: is empty"));
  EXPECT_THAT(FaultWith([](Archive* a) { a->results[0].cpu_us = 0; }),
              HasSubstr("cpu_us: must be a whole number from 1"));
  EXPECT_THAT(FaultWith([](Archive* a) { a->methods[0].name = "SQP "; }), HasSubstr("methods.name: "));
  EXPECT_THAT(FaultWith([](Archive* a) { a->results[0].margin_relaxed = 2.0; }),
              HasSubstr("margin_relaxed: must be a number from 0 to 1"));
  EXPECT_THAT(FaultWith([](Archive* a) { a->seed = -1; }), HasSubstr("seed: must be a whole number"));
}

TEST(ArchiveFile, UnknownAndMissingKeysAreNamed) {
  const auto with_header = [](const std::string& from, const std::string& to) {
    std::string content = EncodeArchive(Sample());
    content.erase(0, content.find('\n') + 1);
    const std::size_t at = content.find(from);
    EXPECT_NE(at, std::string::npos);
    content.replace(at, from.size(), to);
    return FaultOf("legopt-archive 1 " + Blake2bHex(content) + "\n" + content);
  };
  EXPECT_THAT(with_header("\"seed\":7,", ""), HasSubstr("seed: is missing"));
  EXPECT_THAT(with_header("\"seed\":7,", "\"seed\":7,\"sed\":7,"), HasSubstr("sed: is an unknown key"));
  EXPECT_THAT(with_header("\"solid\"", "\"loose\""), HasSubstr("rule: is none of the known words (got '\"loose\"')"));
  EXPECT_THAT(with_header("{\"about\"", "{about"), HasSubstr("a.legopt-archive: header"));
}

class ArchiveCommand : public CommandLine {
 protected:
  // Solves two postures and packs them.
  std::filesystem::path Packed() {
    const std::string database = (folder_.path() / "r.sqlite").string();
    const auto solved =
        Run({"run", "quick", "--methods", "SQP", "--tasks", "posture", "--problems", "0-1", "--db", database});
    EXPECT_EQ(solved.exit_code, 0) << solved.err;
    const std::filesystem::path file = folder_.path() / "r.legopt-archive";
    const auto packed = Run({"archive", "pack", "--db", database, "--out", file.string()});
    EXPECT_EQ(packed.exit_code, 0) << packed.err;
    EXPECT_THAT(packed.out, HasSubstr("2 methods, 8 of 8 jobs with a result"));
    EXPECT_THAT(packed.err, HasSubstr("the archive does not state: authors, licence, code"));
    return file;
  }
  std::string Written(const Archive& archive) {
    const std::filesystem::path file = folder_.path() / "changed.legopt-archive";
    std::ofstream(file, std::ios::binary) << EncodeArchive(archive);
    return file.string();
  }
};

TEST_F(ArchiveCommand, IsJudgedAgainToTheSameBytesAndAFalseClaimIsFound) {
  const std::filesystem::path file = Packed();
  const auto first = Run({"archive", "judge", file.string(), "--out", "a.json", "--format", "csv"});
  EXPECT_EQ(first.exit_code, 0) << first.err;
  EXPECT_THAT(first.out, HasSubstr("SQP,10,100,posture,in_collision,2,2,2,2,2,2,0\n"));
  Archive archive = ReadArchive(file);
  EXPECT_THAT(Run({"archive", "check", file.string()}).out, HasSubstr("hash " + archive.hash));

  archive.results[0].waypoints[0][3] += 0.5;
  const auto moved = Run({"archive", "judge", Written(archive)});
  EXPECT_EQ(moved.exit_code, 12);
  EXPECT_THAT(moved.err, HasSubstr("1 of 8 results have another verdict or cost than the archive states"));

  archive = ReadArchive(file);
  archive.results[0].waypoints.clear();
  EXPECT_EQ(Run({"archive", "judge", Written(archive)}).exit_code, 12) << "a success without a solution";

  archive = ReadArchive(file);
  archive.results[1].cost = std::nextafter(*archive.results[1].cost, 0.0);
  EXPECT_EQ(Run({"archive", "judge", Written(archive)}).exit_code, 12) << "one bit of a cost";

  archive = ReadArchive(file);
  archive.dataset_hash = std::string(64, '0');
  EXPECT_EQ(Run({"archive", "judge", Written(archive)}).exit_code, 5) << "no such dataset";
}

std::string ReadText(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

// The rows of a table without the caption, which names machines.
std::string RowsOf(const std::string& json) { return ParseJson(json, "table").at("rows").dump(); }

TEST_F(ArchiveCommand, AnUnpackedArchiveHasTheTableOfItsExperiment) {
  const std::string file = Packed().string(), unpacked = (folder_.path() / "u.sqlite").string();
  const auto done = Run({"archive", "unpack", file, file, "--out", unpacked});
  EXPECT_EQ(done.exit_code, 0) << done.err;
  EXPECT_THAT(done.out, HasSubstr("experiment 2 'quick'"));
  const std::string source = (folder_.path() / "r.sqlite").string();
  const auto before = Run({"table", "1", "--db", source, "--format", "json", "--rule", "physical"});
  for (const std::string experiment : {"1", "2"}) {
    const auto after = Run({"table", experiment, "--db", unpacked, "--format", "json", "--rule", "physical"});
    EXPECT_EQ(after.exit_code, 0) << after.err;
    EXPECT_EQ(RowsOf(after.out), RowsOf(before.out));
  }
  EXPECT_EQ(Run({"replay", "1", "--db", unpacked}).exit_code, 0) << "an unpacked job can be solved again";
  EXPECT_EQ(Run({"service", "doctor", "--db", unpacked}).exit_code, 0);
  ExpectError(Run({"archive", "unpack", file, "--out", unpacked}), 2, "exists; name a new file");

  // Packed again, it is the same archive.
  const std::string again = (folder_.path() / "again.legopt-archive").string();
  EXPECT_EQ(Run({"archive", "pack", "2", "--db", unpacked, "--out", again}).exit_code, 0);
  EXPECT_EQ(ReadArchive(again).hash, ReadArchive(file).hash);
}

TEST_F(ArchiveCommand, TheJudgementOfAnUnpackedArchiveCounts) {
  Archive archive = ReadArchive(Packed());
  ASSERT_EQ(archive.results[0].verdicts[Rule::kSolid], Verdict::kSuccess);
  Eigen::VectorXd& x = archive.results[0].waypoints[0];
  x[x.size() - 5] += 0.5;  // the height of the base: the claim is now false
  archive.results.erase(archive.results.begin() + 1);
  const std::string unpacked = (folder_.path() / "u.sqlite").string();
  const auto done = Run({"archive", "unpack", Written(archive), "--out", unpacked});
  EXPECT_EQ(done.exit_code, 0) << done.err;
  EXPECT_THAT(done.err, HasSubstr("1 of 7 results have another verdict or cost than the archive states"));
  EXPECT_THAT(
      Run({"query", "SELECT state, count(*) FROM jobs GROUP BY state", "--db", unpacked, "--format", "csv"}).out,
      AllOf(HasSubstr("done,7"), HasSubstr("failed,1")));
  EXPECT_THAT(Run({"query", "SELECT verdict_literal FROM results ORDER BY job_id LIMIT 1", "--db", unpacked}).out,
              HasSubstr("foot_pose"));
  EXPECT_THAT(Run({"show", "2", "--db", unpacked}).out, HasSubstr("the archive has no result of this job"));
}

TEST_F(ArchiveCommand, ASiteHasTheJudgedFiguresOfSoundArchives) {
  const std::filesystem::path file = Packed();
  Archive archive = ReadArchive(file);
  const std::string changed = Written(archive) + "x";  // another name, the same content
  std::filesystem::copy_file(file, changed);
  const std::string benchmark = Write("b.yaml",
                                      "name: B\nedition: \"1\"\nabout: text\ntiers:\n  - {id: a, title: T, "
                                      "question: Q, rule: solid, sets: [{dataset: d, hash: " +
                                          archive.dataset_hash + ", tasks: [posture]}]}\n");
  for (const auto& [rule, word] : kEnumNames<Rule>) archive.results[0].verdicts[rule] = Verdict::kWindowUnsolved;
  archive.results[0].waypoints.clear();
  const std::string out = (folder_.path() / "site").string();
  const auto site =
      Run({"archive", "site", file.string(), changed, Written(archive), "--benchmark", benchmark, "--out", out});
  EXPECT_EQ(site.exit_code, 4);
  EXPECT_THAT(site.err, HasSubstr("changed.legopt-archive: result of posture 0: verdict 'window_unsolved'"));
  EXPECT_THAT(site.err, HasSubstr("has the content of another archive of this site"));
  for (const char* made : {"index.html", "viewer.html", "leaderboard.csv", "archives/r.html", "archives/r.judged.json",
                           "archives/r.legopt-archive"}) {
    EXPECT_TRUE(std::filesystem::exists(out + "/" + made)) << made;
  }
  const auto judged = Run({"archive", "judge", file.string(), "--out", "a.json"});
  EXPECT_EQ(ReadText(out + "/archives/r.judged.json"), ReadText(folder_.path() / "a.json"));
  EXPECT_THAT(ReadText(out + "/leaderboard.csv"), HasSubstr("a,d,posture,good,r,SQP,"));

  EXPECT_EQ(Run({"archive", "site", file.string(), "--benchmark", benchmark, "--out", out}).exit_code, 0) << "again";
  const std::string other = (folder_.path() / "other").string();
  std::filesystem::create_directory(other);
  std::ofstream(other + "/thesis.txt") << "precious";
  ExpectError(Run({"archive", "site", file.string(), "--out", other}), 2, "has 'thesis.txt', which no site wrote");
  std::ofstream(out + "/CNAME") << "example.org";
  ExpectError(Run({"archive", "site", file.string(), "--out", out}), 2, "has 'CNAME', which no site wrote");
  std::filesystem::remove(out + "/CNAME");
  EXPECT_TRUE(std::filesystem::exists(other + "/thesis.txt"));

  // A run without any sound archive keeps the former site; the separator at the end of a folder does not matter.
  const std::string before = ReadText(out + "/index.html");
  archive.results.clear();
  archive.dataset_hash = std::string(64, '0');
  const auto none = Run({"archive", "site", Written(archive), "--out", out + "/"});
  EXPECT_EQ(none.exit_code, 4);
  EXPECT_THAT(none.err, HasSubstr("is not on this machine"));
  EXPECT_EQ(ReadText(out + "/index.html"), before);
  EXPECT_EQ(Run({"archive", "site", file.string(), "--benchmark", benchmark, "--out", out + "/"}).exit_code, 0);
  EXPECT_FALSE(std::filesystem::exists(out + "/archives/r-2.html"));
  for (const auto& entry : std::filesystem::directory_iterator(folder_.path())) {
    EXPECT_THAT(entry.path().filename().string(), Not(AnyOf(HasSubstr(".partial"), HasSubstr(".former"))));
  }
  std::filesystem::create_directory(folder_.path() / "empty");
  ExpectError(Run({"archive", "site", "empty", "--out", "s"}), 2, "has no file *.legopt-archive");
}

TEST_F(ArchiveCommand, AboutIsReadStrictly) {
  const std::filesystem::path file = folder_.path() / "about.yaml";
  std::ofstream(file) << "title: T\nauthors: [A, B]\nlicence: MIT\n";
  const ArchiveAbout about = ReadAbout(file);
  EXPECT_EQ(about.title, "T");
  EXPECT_THAT(about.authors, testing::ElementsAre("A", "B"));
  std::ofstream(file) << "titel: T\n";
  EXPECT_THROW(ReadAbout(file), InputError);
}

TEST_F(ArchiveCommand, AFileOfTenGigabytesIsRefusedAtOnce) {
  const std::filesystem::path file = folder_.path() / "big.legopt-archive";
  std::ofstream(file, std::ios::binary) << "legopt-archive 1 ";
  std::filesystem::resize_file(file, std::uintmax_t{10} << 30);
  ExpectError(Run({"archive", "check", file.string()}), 2, "larger than");
}

}  // namespace
}  // namespace legopt::client
