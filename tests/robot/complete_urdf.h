// A robot with every URDF element and attribute that is checked, and functions that corrupt one of them.
#pragma once

#include <tinyxml2.h>

#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace legopt::test {

// Meshes are only located, not read: any file is sufficient. Relative names refer to tests/robot.
inline constexpr const char* kCompleteUrdf = R"(<?xml version="1.0"?>
<robot name="complete" version="1.0">
  <material name="grey"><color rgba="0.5 0.5 0.5 1"/><texture filename="grey.png"/></material>
  <link name="trunk">
    <inertial>
      <origin xyz="0 0.01 0.1" rpy="0 0 0.1"/>
      <mass value="14.2"/>
      <inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/>
    </inertial>
    <visual name="hull">
      <origin xyz="0 0 0.1" rpy="0 0.1 0"/>
      <geometry><mesh filename="gone.stl" scale="0.001 0.001 0.001"/></geometry>
      <material name="red"><color rgba="1 0 0 1"/><texture filename="red.png"/></material>
    </visual>
    <visual><geometry><box size="1 2 3"/></geometry></visual>
    <visual><geometry><sphere radius="1"/></geometry></visual>
    <visual><geometry><cylinder radius="1" length="2"/></geometry></visual>
    <visual><geometry><capsule radius="1" length="2"/></geometry></visual>
    <collision name="chest"><origin xyz="0 0 0.2" rpy="0.1 0 0"/>
      <geometry><box size="0.2 0.2 0.3"/></geometry></collision>
    <collision><geometry><sphere radius="0.1"/></geometry></collision>
    <collision><geometry><cylinder radius="0.1" length="0.4"/></geometry></collision>
    <collision><geometry><capsule radius="0.1" length="0.4"/></geometry></collision>
    <collision><geometry><mesh filename="complete_urdf.h" scale="1 1 1"/></geometry></collision>
  </link>
  <link name="leg"><inertial><mass value="2"/>
    <inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
  <link name="slide"/>
  <link name="lidar"/>
  <joint name="hip" type="revolute">
    <parent link="trunk"/><child link="leg"/>
    <origin xyz="0 0.1 0" rpy="0 0 0.2"/>
    <axis xyz="0 1 0"/>
    <limit lower="-1" upper="2" effort="100" velocity="5"/>
    <dynamics damping="0.1" friction="0.2"/>
    <safety_controller soft_lower_limit="-0.9" soft_upper_limit="1.9" k_position="10" k_velocity="20"/>
    <calibration rising="0.1" falling="0.2" reference_position="0.3"/>
  </joint>
  <joint name="rail" type="prismatic"><parent link="trunk"/><child link="slide"/><axis xyz="1 0 0"/>
    <limit lower="0" upper="0.1" effort="1" velocity="1"/>
    <mimic joint="hip" multiplier="0.1" offset="0.05"/></joint>
  <joint name="spin" type="continuous"><parent link="trunk"/><child link="lidar"/><axis xyz="0 0 1"/></joint>
</robot>
)";

using Spoil = std::function<void(tinyxml2::XMLElement&)>;

/// Returns the path of an element: names from <robot> on, "robot/link/collision".
inline std::string PathOf(const tinyxml2::XMLElement& element) {
  const tinyxml2::XMLElement* parent =
      element.Parent() == nullptr ? nullptr : const_cast<tinyxml2::XMLNode*>(element.Parent())->ToElement();
  return parent == nullptr ? element.Name() : PathOf(*parent) + "/" + element.Name();
}

/// Collects all elements below and including `root`, in document order.
inline void CollectElements(tinyxml2::XMLElement* root, std::vector<tinyxml2::XMLElement*>* found) {
  found->push_back(root);
  for (auto* e = root->FirstChildElement(); e != nullptr; e = e->NextSiblingElement()) CollectElements(e, found);
}

/// Returns the complete robot with its `index`-th element corrupted.
inline std::string WithCorruptedElement(std::size_t index, const Spoil& spoil) {
  tinyxml2::XMLDocument document;
  document.Parse(kCompleteUrdf);
  std::vector<tinyxml2::XMLElement*> elements;
  CollectElements(document.RootElement(), &elements);
  spoil(*elements.at(index));
  tinyxml2::XMLPrinter printer;
  document.Print(&printer);
  return printer.CStr();
}

}  // namespace legopt::test
