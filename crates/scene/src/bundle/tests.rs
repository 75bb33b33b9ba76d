//! Has each bundle one address, and is an answer read as it was written, however it comes?

use proptest::prelude::*;

use super::*;
use crate::BlobHash;

fn name() -> BlobName {
    BlobName::of(b"x", "glb").unwrap()
}

/// An answer with members of these bytes.
fn answer(members: &[&[u8]]) -> Vec<u8> {
    let mut head = Head::of(members.len());
    for member in members {
        head.add(member.len() as u64).unwrap();
    }
    let bytes = members.iter().map(|member| member.len() as u64).sum();
    assert_eq!(head.answer_bytes(), bytes_of(members.len(), bytes));
    let mut answer = head.into_bytes();
    answer.extend(members.concat());
    answer
}

#[test]
fn a_member_has_one_spelling() {
    let (name, hash) = (name(), name().hash());
    for member in [
        Member::Whole(name.clone()),
        Member::Slice(name.clone(), 0..4096),
        Member::Slice(name.clone(), u64::MAX - 1..u64::MAX),
        Member::Rung(RungName { hash, number: 0 }),
        Member::Rung(RungName { hash, number: 255 }),
    ] {
        assert_eq!(member.to_string().parse(), Ok(member));
    }
    for wrong in [
        "@",
        "@1-1",
        "@2-1",
        "@01-2",
        "@0-",
        "@-1",
        "@0-1-2",
        "@+0-1",
        "@0-18446744073709551616",
        "/x",
        "@0-1@0-1",
    ] {
        let text = format!("{name}{wrong}");
        assert_eq!(text.parse::<Member>(), Err(AddressError::NoMember(text.clone())));
    }
    let rung = RungName { hash, number: 3 }.file_name();
    assert!(format!("{rung}@0-1").parse::<Member>().is_err(), "a rung has no slices");
}

#[test]
fn an_address_names_1_to_64_members() {
    let [one, other] = [&b"x"[..], b"y"].map(|bytes| BlobName::of(bytes, "glb").unwrap());
    let slice = |name: &BlobName, range| Member::Slice(name.clone(), range);
    let named = [
        slice(&one, 0..1),
        slice(&one, 5..7),
        Member::Whole(one.clone()),
        slice(&one, 2..3),
        slice(&other, 2..3),
        Member::Rung(RungName {
            hash: other.hash(),
            number: 1,
        }),
    ];
    let path = path(&named);
    assert_eq!(members(path.strip_prefix(PATH).unwrap()).unwrap(), named);
    let many = |count| members(&vec![one.to_string(); count].join("+"));
    assert_eq!(many(MOST_MEMBERS).unwrap().len(), MOST_MEMBERS);
    assert_eq!(many(MOST_MEMBERS + 1), Err(AddressError::TooMany));
    for wrong in ["".to_owned(), format!("{one}+"), format!("{one}@0-1+{one}@1-1")] {
        assert!(matches!(members(&wrong), Err(AddressError::NoMember(_))), "{wrong}");
    }
}

#[test]
fn no_more_than_a_line_is_repeated_of_what_is_no_member() {
    let Err(AddressError::NoMember(shown)) = members(&"é".repeat(10_000)) else {
        panic!("it is none")
    };
    assert_eq!(shown, "é".repeat(100));
}

#[test]
fn members_come_out_whole_or_not_at_all() {
    let answer = answer(&[b"abc", b"", b"de"]);
    let places = [20..23, 23..23, 23..25];
    for short in 0..answer.len() {
        let so_far = &answer[..short];
        let known = (short >= 20).then(|| places.to_vec());
        assert_eq!(super::places(so_far, 3), known, "after {short} bytes");
        assert_eq!(whole_places(so_far, 3), None);
    }
    assert_eq!(whole_places(&answer, 3), Some(places.to_vec()));
    assert_eq!(whole_places(&[&answer[..], b"f"].concat(), 3), None, "it goes on");
    for other in [0, 1, 2, 4, 65_539] {
        assert_eq!(super::places(&answer, other), None, "a bundle of {other}");
    }
}

#[test]
fn what_is_no_bundle_has_no_members() {
    let sound = answer(&[b"abc", b"de"]);
    let changed = |at: usize, bytes: &[u8]| {
        let mut changed = sound.clone();
        changed[at..at + bytes.len()].copy_from_slice(bytes);
        places(&changed, 2)
    };
    assert!(changed(0, b"BVBN").is_some());
    assert_eq!(changed(3, b"X"), None, "other letters");
    assert_eq!(changed(4, &2_u16.to_le_bytes()), None, "another version");
    assert_eq!(changed(8, &6_u32.to_le_bytes()), None, "one ends before it begins");
    let most = MOST_BYTES as u32;
    assert_eq!(changed(12, &most.to_le_bytes()).unwrap()[1], 19..16 + most as usize);
    assert_eq!(changed(12, &(most + 1).to_le_bytes()), None, "more than a bundle holds");
    assert_eq!(changed(12, &u32::MAX.to_le_bytes()), None, "more than there can be");
}

#[test]
fn a_bundle_holds_8_mib() {
    let mut head = Head::of(3);
    assert_eq!(head.add(MOST_BYTES), Ok(()));
    assert_eq!(head.add(1), Err(TooLarge));
    assert_eq!(head.add(u64::MAX), Err(TooLarge));
    assert_eq!((head.add(0), head.answer_bytes()), (Ok(()), 16 + MOST_BYTES));
}

#[test]
fn an_offer_is_known_by_its_relation() {
    assert_eq!(OFFER, format!("<{PATH}>; rel=\"bundles\""));
    assert!(is_offered(OFFER) && is_offered(&format!("</o/x>; rel=next, {OFFER}")));
    assert!(is_offered("</o/bundle/>; rel=bundles"));
    assert!(!is_offered("") && !is_offered("</o/bundle/>; rel=\"next\""));
}

fn any_member() -> impl Strategy<Value = Member> {
    let blob = || (any::<[u8; 2]>(), "[a-z0-9]{1,8}").prop_map(|(bytes, ext)| BlobName::of(&bytes, &ext).unwrap());
    prop_oneof![
        blob().prop_map(Member::Whole),
        (any::<[u8; 2]>(), any::<u8>()).prop_map(|(bytes, number)| Member::Rung(RungName {
            hash: BlobHash::of(&bytes),
            number
        })),
        (blob(), any::<[u64; 2]>())
            .prop_map(|(name, [a, b])| Member::Slice(name, a.min(b).min(u64::MAX - 1)..a.max(b).max(1))),
    ]
}

proptest! {
    #[test]
    fn what_is_named_is_read_and_no_other_text_names_it(named in prop::collection::vec(any_member(), 1..=MOST_MEMBERS), at: prop::sample::Index, byte in 0_u8..128) {
        let text = path(&named)[PATH.len()..].to_owned();
        prop_assert_eq!(members(&text), Ok(named));
        let mut other = text.into_bytes();
        let at = at.index(other.len());
        other[at] = byte;
        let other = String::from_utf8(other).unwrap();
        if let Ok(named) = members(&other) {
            prop_assert_eq!(path(&named), format!("{PATH}{other}"));
        }
    }

    #[test]
    fn places_of_any_bytes_lie_one_behind_the_other(bytes in prop::collection::vec(any::<u8>(), 0..40), count in 0_usize..9) {
        let mut bytes = [&b"BVBN\x01\0"[..], &bytes].concat();
        if let Some(number) = bytes.get_mut(6..8) {
            number.copy_from_slice(&(count as u16).to_le_bytes());
        }
        // Small enough to be a bundle now and then.
        bytes.iter_mut().skip(8).enumerate().filter(|(i, _)| i % 4 > 0).for_each(|(_, byte)| *byte = 0);
        if let Some(places) = places(&bytes, count) {
            prop_assert_eq!(places.len(), count);
            let mut from = HEAD_BYTES + END_BYTES * count;
            for place in places {
                prop_assert!(place.start == from && place.end >= from);
                from = place.end;
            }
        }
    }
}
