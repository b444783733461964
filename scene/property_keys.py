"""Keys of the custom properties and attributes that Patina writes into a .blend."""

from __future__ import annotations

MEASURED_DATE = "patina_date"  # on the material: date of the fit, ISO 8601
AS_MEASURED = "patina_as_measured"  # on the material: its node inputs as measured, JSON
SAMPLE_POINTS = "patina_samples"  # on the material: rows of MeasuredPoints
INTERVAL_BAND = "patina_interval"  # on the material: values of a Band
EARLIER_COEFFICIENTS = "patina_earlier_coefficients"  # on the material: of the previous fit
EARLIER_BASIS = "patina_earlier_basis"  # on the material: basis of these
EVIDENCE_COLOURS = "Patina: "  # prefix of colour attributes of the mesh, followed by the cause
OVERLAY = "patina_overlay"  # on the mesh: what is shown; on the screen: also the shading before
SHOWN_SLOTS = "patina_shown"  # face attribute: slots whose colours were drawn last
LOBE_GROUP_LAYOUT = "patina_lobe_group"  # on a node group: version of its nodes
LIGHT_NAME = "patina_light"  # on a lamp or a camera: the light's name in its capture
LAMP_KIND = "patina_kind"  # on a lamp: distant, near or mounted
INTENSITY_KNOWN = "patina_known"  # on a lamp: whether its intensity was measured
HOLDING_CAMERA = "patina_holder"  # on a lamp: label of the camera that a flash is fixed to
LAMP_AS_IMPORTED = "patina_made"  # on a lamp: its placement when it was imported
MAP_KIND = "patina_map"  # on a node: which map it shows
PROVENANCE = "patina_provenance"  # on the material: sentences on its origin
CAPTURE = "patina_capture"  # on data-blocks created from a capture: absolute path of its file
EXPOSED_PHOTO = "patina_exposed"  # on the one image that shows photos at another exposure
VIEW_KIND = "patina_view"  # on the image: which view it shows
CANVAS_PHOTO = "patina_canvas"  # on the image: index of its photo in the capture
FIT_SLOTS = "patina_slots"  # face attribute of the scan while a fit runs
PROPOSED_SLOTS = "patina_materials"  # face attribute of the mesh: last proposed materials
PROPOSAL_CONFIDENCE = "patina_confidence"  # face attribute of the mesh: confidence of these
PLACEHOLDER = "patina_proposed"  # on coloured placeholders for materials not fitted yet
COMPONENTS_FILE = "patina_components"  # on the material: name of its components' EXR
MEASURED_SAMPLING_FILE = "patina_measured_sampling"  # on an edited material: EXR as measured
SHOWN_TRAITS = "patina_traits_shown"  # on the material: state of the traits in each part
NO_OSL_REASON = "patina_without_osl"  # on the material: why it has no OSL branch
MEASURED_NAME = "patina_measured"  # on the material: the name it has in its capture
COEFFICIENTS = "patina_coefficients"  # on the material: those of red, then green, then blue
BASIS_VERSION = "patina_basis"  # on the material: version of their basis
MASK_PHOTO_INDEX = "patina_shadow_of"  # on the image: index of its photo in the capture
MASK_PHOTO_NAME = "patina_photo"  # on the image: name of its photo
MASK_KIND = "patina_mask"  # on the image: what it masks, one of EXCLUDED_MASKS
FOUND_UP = "patina_found_up"  # on the collection of a scan: up axis, standard error, agreement
APPLIED_UP = "patina_up"  # on the collection of a scan: its axis that was turned to +z
ORIGIN = "patina_origin"  # on the collection of a scan: offset of its frame, scan units
RESOLUTION = "patina_resolution"  # on a camera: (width, height) of its photos, pixels
CAMERA_LABEL = "patina_label"  # on a camera: its label in the scan
LIT_PHOTO = "patina_lit"  # on a camera: name of the lit photo behind it
LIT_PHOTO_INDEX = "patina_place"  # on a camera: index of that photo in the capture
REMAINDER_FILE = "patina_remainder"  # on the material: name of the EXR of its remaining components
SAMPLING_FILE = "patina_sampling"  # on the material: name of its sampling EXR
