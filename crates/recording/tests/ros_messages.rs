//! Messages of ROS 2 by their definitions: what is read of a text, and what becomes of a message and of bytes that are
//! none.

use isochrone_recording::ByteOrder;
use isochrone_recording::message::{
    Definitions, Extent, FieldPath, MessageType, RosValue, decode, encode,
};
use proptest::prelude::*;

/// A definition with every kind of field.
const STATE: &str = "\
# A comment, isn't it?
uint8 OK=0            # a constant
string GREETING = \"# no comment\"
std_msgs/Header header
bool is_on true
int64 ticks -3
float32 level 0.5
float64[3] gains [1.0, 2, 3e0]
string<=8 unit \"m\"
string[] name
float64[<=4] position
Pair[] pairs
uint64[2] words
";

fn definitions() -> Definitions {
    let mut definitions = Definitions::default();
    definitions.add("builtin_interfaces/Time", "int32 sec\nuint32 nanosec\n");
    definitions.add("std_msgs/Header", "builtin_interfaces/Time stamp\nstring frame_id\n");
    definitions.add("own/Pair", "int16 a\nfloat64 b\n");
    definitions.add("own/State", STATE);
    definitions.add("own/Empty", "");
    definitions
}

fn state() -> std::sync::Arc<MessageType> {
    definitions().find("own/msg/State").unwrap()
}

fn filled(state: &MessageType) -> RosValue {
    let mut value = RosValue::of(state);
    let path = |written: &str| FieldPath::find(state, written).unwrap();
    assert!(path("header.stamp.sec").set_number(&mut value, -5.0));
    assert!(path("header.frame_id").set(&mut value, RosValue::Text("base".into())));
    assert!(path("gains[1]").set_number(&mut value, f64::INFINITY));
    assert!(path("words[1]").set(&mut value, RosValue::Integer(u64::MAX.into())));
    let names = ["a", "\u{fc}"].map(|name| RosValue::Text(name.into()));
    assert!(path("name").set(&mut value, RosValue::Several(names.into())));
    assert!(path("position[]").set(&mut value, RosValue::Numbers(vec![-0.0, 1e-300])));
    let pair = RosValue::Message(vec![RosValue::Number(-2.0), RosValue::Number(0.25)]);
    assert!(path("pairs").set(&mut value, RosValue::Several(vec![pair; 2])));
    value
}

/// The same message with its numbers in the other order of bytes: those of this test have no alignment to move.
fn swapped(body: &[u8], sizes: &[usize]) -> Vec<u8> {
    let (mut at, mut swapped) = (0, Vec::new());
    for size in sizes {
        swapped.extend(body[at..at + size].iter().rev());
        at += size;
    }
    assert_eq!(at, body.len());
    swapped
}

#[test]
fn a_message_has_the_defaults_of_its_definition() {
    let state = state();
    let value = RosValue::of(&state);
    let number = |path| FieldPath::find(&state, path).unwrap().number(&value);
    assert_eq!(number("is_on"), Some(1.0));
    assert_eq!(number("ticks"), Some(-3.0));
    assert_eq!((number("level"), number("gains[2]")), (Some(0.5), Some(3.0)));
    let unit = FieldPath::find(&state, "unit").unwrap();
    assert_eq!(unit.value(&value).and_then(RosValue::text), Some("m"));
    assert_eq!(
        FieldPath::find(&state, "position").unwrap().field_type().extent,
        Extent::Sequence(Some(4))
    );
    assert_eq!(state.dds_name(), "own::msg::dds_::State_");
}

#[test]
fn a_message_reads_back_as_it_was() {
    let state = state();
    let value = filled(&state);
    let body = encode(&state, &value).unwrap();
    assert_eq!(decode(&state, &body, ByteOrder::Little), Ok(value));
}

#[test]
fn a_default_is_what_a_message_can_have() {
    let mut definitions = definitions();
    definitions.add("own/Tenth", "float32 tenth 0.1\n");
    let message = definitions.find("own/Tenth").unwrap();
    let body = encode(&message, &RosValue::of(&message)).unwrap();
    assert_eq!(decode(&message, &body, ByteOrder::Little), Ok(RosValue::of(&message)));
}

#[test]
fn fields_stand_where_cdr_has_them_in_both_orders() {
    let definitions = definitions();
    let pair = definitions.find("own/Pair").unwrap();
    let value = RosValue::Message(vec![RosValue::Number(-2.0), RosValue::Number(1.0)]);
    let body = encode(&pair, &value).unwrap();
    assert_eq!(body, [0xfe, 0xff, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0xf0, 0x3f]);
    let big = swapped(&body, &[2, 6, 8]);
    assert_eq!(decode(&pair, &big, ByteOrder::Big), Ok(value));
    let header = definitions.find("std_msgs/Header").unwrap();
    let body = encode(&header, &RosValue::of(&header)).unwrap();
    assert_eq!(body, [0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0]);
    let empty = definitions.find("own/Empty").unwrap();
    assert_eq!(encode(&empty, &RosValue::of(&empty)).unwrap(), [0]);
}

#[test]
fn some_writers_fill_up_and_others_end_an_empty_text_without_its_zero() {
    let header = definitions().find("std_msgs/Header").unwrap();
    let value = RosValue::of(&header);
    for ending in [&[0, 0, 0, 0][..], &[1, 0, 0, 0, 0, 0, 0, 0]] {
        let body = [&[0; 8][..], ending].concat();
        assert_eq!(decode(&header, &body, ByteOrder::Little), Ok(value.clone()));
    }
}

#[test]
fn what_does_not_fit_into_a_field_is_refused_with_the_field() {
    let state = state();
    for (path, number, says) in [
        ("is_on", 2.0, "is_on: 2 is no bool"),
        ("is_on", f64::NAN, "is_on: NaN is no bool"),
        ("ticks", 0.5, "ticks: 0.5 is no int64"),
        ("ticks", 1e19, "ticks: 10000000000000000000 is no int64"),
        ("level", 1e300, "is no float32"),
        ("header.stamp.nanosec", -1.0, "header.stamp.nanosec: -1 is no uint32"),
        ("words[1]", -1.0, "words[1]: -1 is no uint64"),
    ] {
        let mut value = RosValue::of(&state);
        assert!(FieldPath::find(&state, path).unwrap().set_number(&mut value, number));
        let error = encode(&state, &value).unwrap_err().to_string();
        assert!(error.contains(says), "{error}");
    }
    for (path, wrong, says) in [
        ("unit", RosValue::Text("too long a unit".into()), "is no string<=8"),
        ("unit", RosValue::Text("a\0b".into()), "unit: "),
        ("position", RosValue::Numbers(vec![0.0; 5]), "position: 5 elements are no float64[<=4]"),
        ("gains", RosValue::Numbers(vec![0.0; 2]), "gains: 2 elements are no float64[3]"),
        ("pairs", RosValue::Several(vec![RosValue::Number(1.0)]), "pairs[0]: it is no own/Pair"),
        ("name", RosValue::Number(1.0), "name: it is no string[]"),
    ] {
        let mut value = RosValue::of(&state);
        assert!(FieldPath::find(&state, path).unwrap().set(&mut value, wrong));
        let error = encode(&state, &value).unwrap_err().to_string();
        assert!(error.contains(says), "{error}");
    }
}

#[test]
fn lengths_that_the_bytes_do_not_hold_are_refused_before_memory_is_taken() {
    let mut definitions = definitions();
    definitions.add("own/Names", "string[] name\n");
    definitions.add("own/Nested", "own/Names[] names\n");
    definitions.add("own/Samples", "float64[] data\n");
    for name in ["own/Names", "own/Nested", "own/Samples"] {
        let message = definitions.find(name).unwrap();
        for claimed in [u32::MAX, 0x7fff_ffff, 5] {
            let body = [&claimed.to_le_bytes()[..], &[0; 12]].concat();
            let error = decode(&message, &body, ByteOrder::Little).unwrap_err().to_string();
            assert!(error.contains("do not fit"), "{error}");
        }
    }
}

#[test]
fn a_definition_that_is_wrong_is_refused_with_its_line() {
    for (text, says) in [
        ("float64 a\nfloat64 a\n", "own/Bad, line 2: there is a field a already"),
        ("float64 a b\n", "line 1: \"b\" is no float64"),
        ("uint8 X=256\n", "\"256\" is no uint8"),
        ("float32 a 1e39\n", "\"1e39\" is no float32"),
        ("float64\n", "\"\" is no name of a field"),
        ("float64[ a\n", "lacks its closing bracket"),
        ("float64[x] a\n", "\"x\" is no number of elements"),
        ("Pair[0] a\n", "line 1: \"Pair[0]\" has no elements"),
        ("int8[2] a [1]\n", "[1] has 1 elements, and 2 are possible"),
        ("wstring a\n", "wstring is not supported"),
        ("Missing a\n", "own/Bad, line 1: there is no definition of own/Missing"),
        ("\u{1b}[2J a\n", "line 1: \"\\u{1b}[2J\" lacks its closing bracket"),
        ("\u{1b}2J a\n", "line 1: there is no definition of own/\\u001b2J"),
        ("Bad[] again\n", "perhaps in itself"),
        ("float64[1000000] a\n", "at most 1048576 are possible"),
    ] {
        let mut definitions = definitions();
        definitions.add("own/Bad", text);
        let error = definitions.find("own/Bad").unwrap_err().to_string();
        assert!(error.contains(says), "{error}");
    }
}

#[test]
fn a_path_that_leads_nowhere_says_what_there_is() {
    let state = state();
    for (path, says) in [
        ("velocity", "own/msg/State has no field \"velocity\"; it has header, is_on, ticks"),
        ("header.stamp.s", "builtin_interfaces/msg/Time has no field \"s\"; it has sec, nanosec"),
        ("level.x", "level is no message"),
        ("level[0]", "level has no elements"),
        ("gains[3]", "gains has 3 elements, counted from 0: there is no gains[3]"),
        ("gains[a]", "an element is a number in brackets"),
        ("gains[0][1]", "has one index at most"),
        ("", "has no field \"\""),
    ] {
        let error = FieldPath::find(&state, path).unwrap_err().to_string();
        assert!(error.contains(says), "{error}");
    }
    assert!(FieldPath::find(&state, "position[3]").unwrap().is_of_sequence());
    assert!(FieldPath::find(&state, "pairs[0].b").unwrap().is_of_sequence());
    assert!(!FieldPath::find(&state, "gains[0]").unwrap().is_of_sequence());
}

#[test]
fn definitions_are_found_in_the_folders_of_ros() {
    let folder = std::env::temp_dir().join(format!("isochrone-definitions-{}", std::process::id()));
    let write = |path: &str, text: &str| {
        let path = folder.join(path);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, text).unwrap();
    };
    write("share/pumps/msg/Pump.msg", "Speed speed\n");
    write("share/pumps/msg/Speed.msg", "float32 rpm\n");
    write("valves/Valve.msg", "bool open\n");
    write("valves/README.md", "no definition");
    let mut definitions = Definitions::default();
    assert_eq!(definitions.add_folder(&folder), Ok(3));
    std::fs::remove_dir_all(&folder).unwrap();
    assert!(definitions.find("pumps/msg/Pump").is_ok() && definitions.find("valves/Valve").is_ok());
    let gone = definitions.add_folder(&folder).unwrap_err().to_string();
    assert!(gone.contains("cannot read"), "{gone}");
}

#[test]
fn a_service_has_two_halves() {
    let mut definitions = Definitions::default();
    definitions.add_service("own/Ask", "string question\n---\nstring answer\n");
    let request = definitions.find("own/Ask_Request").unwrap();
    assert_eq!(request.dds_name(), "own::srv::dds_::Ask_Request_");
    assert_eq!(definitions.find("own/Ask_Response").unwrap().fields[0].name, "answer");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1000))]

    #[test]
    fn a_mutated_payload_is_refused_or_read_as_what_it_is(
        at in 0_usize..400,
        byte in any::<u8>(),
        length in 0_usize..400,
        count_at in 0_usize..400,
        count in any::<u32>(),
        is_big in any::<bool>(),
    ) {
        let state = state();
        let mut body = encode(&state, &filled(&state)).unwrap();
        let last = body.len() - 1;
        body[at.min(last)] = byte;
        let count_at = count_at.min(last - 3);
        body[count_at..count_at + 4].copy_from_slice(&count.to_le_bytes());
        body.resize(length, byte);
        let order = if is_big { ByteOrder::Big } else { ByteOrder::Little };
        if let Ok(value) = decode(&state, &body, order) {
            // Whatever was read can be written, in no more bytes than it came in, but for the zeros of empty texts.
            let again = encode(&state, &value).unwrap();
            prop_assert!(again.len() <= body.len() + 16, "{} of {}", again.len(), body.len());
        }
    }
}
