#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "legopt/dataset/dataset.h"
#include "legopt/dataset/problem_definition.h"
#include "legopt/types/enum_names.h"

namespace legopt {

/// @file
/// Contact sequences of multicontact-api (https://github.com/loco-3d/multicontact-api), in the XML archives that its
/// `saveAsXML` writes and `loadFromXML` reads. A phase is a stance: the contacts that carry, with their placements.
/// docs/how-to/exchange-contact-sequences.md lists the exchanged data.

/// Type of a contact in multicontact-api.
enum class SequenceContactType : std::uint8_t { kUndefined, kPlanar, kPoint };

template <>
inline constexpr auto kEnumNames<SequenceContactType> =
    MakeEnumNames<SequenceContactType>({{SequenceContactType::kUndefined, "undefined"},
                                        {SequenceContactType::kPlanar, "planar"},
                                        {SequenceContactType::kPoint, "point"}});

/// One contact of a phase: `ContactPatch` with its `ContactModel`.
struct SequencePatch {
  /// Friction coefficient of a patch for which none was set.
  static constexpr double kNoFriction = -1.0;

  std::string effector;                                    ///< name of the frame in contact
  Eigen::Vector3d position = Eigen::Vector3d::Zero();      ///< translation of the placement in the world, m
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();  ///< rotation of the placement; z: normal of the surface
  double friction = kNoFriction;                           ///< Coulomb coefficient
  SequenceContactType type = SequenceContactType::kUndefined;
  std::vector<Eigen::Vector3d> points = {};  ///< points where forces act, in the frame of the placement, m

  bool operator==(const SequencePatch&) const = default;
};

/// A phase: contacts that exist at the same time.
struct SequencePhase {
  std::vector<SequencePatch> patches;  ///< one per effector, in the order of `effector_in_contact`
  Eigen::VectorXd first, last;         ///< configurations q_init and q_final in Pinocchio's order; empty: unknown
};

/// A contact sequence, with LegOpt's stances if legopt wrote the file.
struct ContactSequence {
  std::vector<SequencePhase> phases;
  /// One stance per phase, from the comment at the end of a file that legopt wrote; else empty. They have what patches
  /// lack: the exact quaternion, contacts that only touch, slides and pushes.
  std::vector<Stance> stances;
};

/// Reads a contact sequence from an XML archive. Reads contacts and configurations; ignores trajectories. Throws
/// InputError with file, element, value and fix: a binary or text archive, another document, a class version above 2,
/// no phases, fewer phases than `size`, an effector without patch or placement, a friction that is negative (other
/// than SequencePatch::kNoFriction) or not in (0, 2], a rotation that is not orthonormal, a number that is not finite.
ContactSequence ReadContactSequence(const std::filesystem::path& file);

/// Formats a contact sequence as an XML archive with 17 digits per number, so that reading returns the same bits.
std::string FormatContactSequence(const ContactSequence& sequence);

/// Stances of a contact sequence.
struct ImportedSequence {
  std::vector<Stance> stances;        ///< one per phase
  std::vector<std::string> warnings;  ///< differences between the sequence and the dataset's contacts
};

/// Converts the phases of a sequence to stances of a dataset. An effector is a contact of the dataset: the one that
/// `effectors` names for it, the one with its name, or the only one on the link, or behind the joint, with its name.
/// The placement is the target of the contact's frame. Friction that differs from the contact's own becomes a property
/// of the stance. Uses `ContactSequence::stances` as they are where they express the patches of their phase exactly.
///
/// Throws InputError for an effector that no contact has, two effectors of one contact, a phase without contacts, and a
/// value of `effectors` that is no contact. `file` names the sequence in errors.
ImportedSequence StancesOf(const ContactSequence& sequence, const Dataset& dataset,
                           const std::map<std::string, std::string>& effectors, const std::string& file);

/// Converts stances of a dataset to a contact sequence; effectors have the names of the contacts. `waypoints`: empty,
/// or the configurations of a solution, the same number for each stance (one or more); the first and the last of each
/// become the configurations of its phase.
ContactSequence SequenceOf(const Dataset& dataset, std::span<const Stance> stances,
                           std::span<const Eigen::VectorXd> waypoints = {});

/// Converts a configuration to Pinocchio's order for the same URDF with a free-flyer: base position, base quaternion
/// x y z w, then joints depth first with siblings sorted by joint name. Continuous joints are cosine and sine; joints
/// that follow others have their own value.
Eigen::VectorXd PinocchioConfiguration(const RobotModel& robot, const Eigen::VectorXd& x);

}  // namespace legopt
