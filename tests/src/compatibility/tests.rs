use super::{Difference, compare};
use serde_json::{Value, json};

fn description() -> Value {
    json!({
        "paths": { "/things": { "post": {
            "operationId": "create_thing",
            "security": [{ "token": ["run"] }, { "session": ["run"] }],
            "parameters": [{ "name": "limit", "in": "query", "required": false, "schema": { "type": "integer", "maximum": 9, "default": 5 } }],
            "requestBody": { "required": true, "content": { "application/json": { "schema": { "$ref": "#/components/schemas/New" } } } },
            "responses": {
                "201": {
                    "headers": { "Location": { "schema": { "type": "string" } } },
                    "content": { "application/json": { "schema": { "$ref": "#/components/schemas/Thing" } } }
                },
                "404": {}
            }
        } } },
        "components": { "schemas": {
            "Colour": { "type": "string" },
            "New": { "type": "object", "required": ["kind"], "properties": {
                "kind": { "type": "string", "enum": ["a", "b"] },
                "size": { "type": "number", "minimum": 0, "default": 2 },
                "colour": { "$ref": "#/components/schemas/Colour" },
                "place": { "oneOf": [{ "type": "null" }, shape("point")] },
                "names": { "type": "array", "items": { "type": "string" } },
                "sizes": { "type": "object", "additionalProperties": { "type": "number" } }
            } },
            "Thing": { "type": "object", "required": ["id"], "properties": {
                "id": { "type": "string" },
                "colour": { "$ref": "#/components/schemas/Colour" },
                "place": { "oneOf": [{ "type": "null" }, shape("point")] },
                "kinds": { "type": "array", "items": { "type": "string", "enum": ["a", "b"] } }
            } }
        } }
    })
}

/// An alternative of a union, recognised by its kind.
fn shape(kind: &str) -> Value {
    json!({ "type": "object", "properties": { "kind": { "type": "string", "enum": [kind] } } })
}

/// The description with one place changed; `null` removes it.
fn changed(pointer: &str, value: Value) -> Value {
    let mut document = description();
    let (parent, name) = pointer.rsplit_once('/').unwrap();
    let parent = document.pointer_mut(parent).unwrap().as_object_mut().unwrap();
    let name = name.replace("~1", "/");
    if value.is_null() {
        parent.remove(&name)
    } else {
        parent.insert(name, value)
    };
    document
}

fn assert_break(place: &str, value: Value, change: &str) {
    let found = compare(&description(), &changed(place, value));
    assert!(found.breaks.iter().any(|one| one.contains(change)), "{place}: {found:?}");
}

fn assert_addition(place: &str, value: Value) {
    let found = compare(&description(), &changed(place, value));
    assert!(found.breaks.is_empty() && !found.additions.is_empty(), "{place}: {found:?}");
}

const OPERATION: &str = "/paths/~1things/post";
const NEW: &str = "/components/schemas/New";
const THING: &str = "/components/schemas/Thing";

#[test]
fn equal_descriptions_have_no_difference() {
    assert_eq!(compare(&description(), &description()), Difference::default());
}

#[test]
fn incompatible_change_is_a_break() {
    for (place, value, change) in [
        ("/paths/~1things".to_owned(), Value::Null, "the operation is gone"),
        (format!("{OPERATION}/operationId"), json!("make_thing"), "its name"),
        (format!("{OPERATION}/parameters"), json!([]), "the parameter is gone"),
        (format!("{OPERATION}/responses/201"), Value::Null, "no longer answered with 201"),
        (format!("{OPERATION}/responses/202"), json!({}), "may be answered with 202"),
        (format!("{OPERATION}/requestBody"), Value::Null, "it is no longer taken"),
        (format!("{NEW}/required"), json!(["kind", "size"]), "the field is required"),
        (format!("{NEW}/properties/kind/enum"), json!(["a"]), "\"b\" is gone"),
        (format!("{NEW}/properties/size/minimum"), json!(1), "minimum"),
        (format!("{NEW}/properties/size/type"), json!("integer"), "its type"),
        (format!("{NEW}/properties/size/maximum"), json!(9), "maximum"),
        (format!("{NEW}/additionalProperties"), json!(false), "other fields are refused"),
        (format!("{NEW}/properties/size"), Value::Null, "the field is gone"),
        (format!("{THING}/properties/id"), Value::Null, "the field is gone"),
        (format!("{THING}/required"), json!([]), "the field may be missing"),
        (format!("{THING}/properties/id/type"), json!(["string", "null"]), "its type"),
    ] {
        assert_break(&place, value, change);
    }
    let mut needs_more = description();
    needs_more["components"]["schemas"]["New"]["properties"]["name"] = json!({ "type": "string" });
    needs_more["components"]["schemas"]["New"]["required"] = json!(["kind", "name"]);
    assert_eq!(compare(&description(), &needs_more).breaks.len(), 1);
}

#[test]
fn compatible_change_is_an_addition() {
    for (place, value) in [
        ("/paths/~1more".to_owned(), json!({ "get": {} })),
        (format!("{NEW}/properties/kind/enum"), json!(["a", "b", "c"])),
        (format!("{NEW}/properties/name"), json!({ "type": "string" })),
        (format!("{NEW}/properties/size/minimum"), json!(-1)),
        (format!("{NEW}/properties/size/type"), json!(["number", "null"])),
        (format!("{THING}/properties/name"), json!({ "type": "string" })),
        (format!("{THING}/properties/kinds/items/enum"), json!(["a"])),
    ] {
        assert_addition(&place, value);
    }
    let more = compare(&description(), &changed("/paths/~1more", json!({ "get": {} })));
    assert_eq!(more.additions, ["get /more: a new operation"]);
    for (place, value) in [
        (format!("{OPERATION}/responses/409"), json!({})),
        (format!("{OPERATION}/responses/404"), Value::Null),
        (format!("{THING}/required"), json!(["id", "kinds"])),
    ] {
        let found = compare(&description(), &changed(&place, value));
        assert!(found.breaks.is_empty(), "{place}: {found:?}");
    }
}

#[test]
fn changed_default_is_a_break() {
    let limit = json!([{ "name": "limit", "in": "query", "required": false, "schema": { "type": "integer", "maximum": 9, "default": 3 } }]);
    assert_break(&format!("{OPERATION}/parameters"), limit, "its default is 3 instead of 5");
    assert_break(&format!("{NEW}/properties/size/default"), json!(3), "its default is 3 instead of 2");
    assert_break(&format!("{NEW}/properties/size/default"), Value::Null, "its default is absent instead of 2");
    let beside_reference = json!({ "$ref": "#/components/schemas/Colour", "default": "red" });
    let old = changed(&format!("{NEW}/properties/colour"), beside_reference);
    let breaks = compare(&old, &description()).breaks;
    assert_eq!(breaks, ["post /things body.colour: its default is absent instead of \"red\""]);
    assert_addition(&format!("{NEW}/properties/kind/default"), json!("a"));
}

#[test]
fn new_word_in_a_response_is_a_break() {
    assert_break(&format!("{THING}/properties/kinds/items/enum"), json!(["a", "b", "c"]), "the new word \"c\"");
}

#[test]
fn request_field_may_become_nullable() {
    let nullable = json!({ "oneOf": [{ "type": "null" }, { "$ref": "#/components/schemas/Colour" }] });
    assert_addition(&format!("{NEW}/properties/colour"), nullable.clone());
    assert_break(&format!("{THING}/properties/colour"), nullable, "the new shape null");
    let nullable = json!({ "oneOf": [{ "type": "number", "minimum": 0 }, { "type": "null" }], "default": 2 });
    assert_addition(&format!("{NEW}/properties/size"), nullable);
    let narrower = json!({ "oneOf": [{ "type": "number", "minimum": 1 }, { "type": "null" }], "default": 2 });
    assert_break(&format!("{NEW}/properties/size"), narrower, "minimum is 1 instead of 0");
}

#[test]
fn request_union_may_gain_a_member_and_response_union_may_lose_one() {
    let more = json!({ "oneOf": [shape("line"), { "type": "null" }, shape("point")] });
    assert_addition(&format!("{NEW}/properties/place"), more.clone());
    assert_break(&format!("{THING}/properties/place"), more, "the new shape object kind \"line\"");
    let fewer = shape("point");
    assert_addition(&format!("{THING}/properties/place"), fewer.clone());
    assert_break(&format!("{NEW}/properties/place"), fewer, "the shape null is gone");
}

#[test]
fn operation_may_need_a_weaker_right_but_no_other_one() {
    let security = format!("{OPERATION}/security");
    assert_addition(&security, json!([]));
    assert_addition(&security, json!([{ "token": [] }, { "session": [] }]));
    assert_addition(&security, json!([{ "token": ["run"] }, { "session": ["run"] }, { "token": ["read"] }]));
    for stronger in [
        json!([{ "token": ["read"] }, { "session": ["read"] }]),
        json!([{ "token": ["run", "read"] }, { "session": ["run"] }]),
        json!([{ "session": ["run"] }]),
        json!([{ "session": ["administer"] }]),
    ] {
        assert_break(&security, stronger, "it needs the right");
    }
    // Every administrator has the right to read.
    let old = changed(&security, json!([{ "session": ["administer"] }]));
    let new = changed(&security, json!([{ "session": ["read"] }]));
    assert_eq!(compare(&old, &new).breaks, Vec::<String>::new());
}

#[test]
fn response_header_may_be_added_but_not_removed_or_changed() {
    let headers = format!("{OPERATION}/responses/201/headers");
    assert_break(&headers, Value::Null, "the header Location is gone");
    assert_break(&headers, json!({ "Location": { "schema": { "type": "integer" } } }), "its type");
    assert_addition(&format!("{headers}/ETag"), json!({ "schema": { "type": "string" } }));
}

#[test]
fn rules_of_lists_and_objects_may_be_lifted_but_not_tightened() {
    for (place, rule) in [
        ("names/uniqueItems", json!(true)),
        ("sizes/minProperties", json!(1)),
        ("sizes/propertyNames", json!({ "type": "string", "enum": ["width"] })),
        ("sizes/if", json!({ "required": ["width"] })),
    ] {
        let place = format!("{NEW}/properties/{place}");
        let tightened = changed(&place, rule);
        assert_eq!(compare(&description(), &tightened).breaks.len(), 1, "{place}");
        let lifted = compare(&tightened, &description());
        assert!(lifted.breaks.is_empty() && lifted.additions.len() == 1, "{place}: {lifted:?}");
    }
    let any_name = json!({ "type": "string" });
    let same = compare(&description(), &changed(&format!("{NEW}/properties/sizes/propertyNames"), any_name));
    assert_eq!(same, Difference::default());
}
