//! The layer that bounds the memory of request bodies. A piece of a body keeps the whole buffer into which it was
//! received, so a body that arrives byte by byte would need thousands of times its size.

use axum::body::{Body, Bytes};
use axum::extract::Request;
use futures_util::{StreamExt, stream};

/// Size from which a piece is passed on, bytes.
const PIECE_BYTES: usize = 64 << 10;

/// Copies the body into pieces of at least [`PIECE_BYTES`], except the last one.
pub(super) async fn gather(request: Request) -> Request {
    request.map(|body| Body::from_stream(stream::try_unfold(body.into_data_stream().fuse(), next_piece)))
}

async fn next_piece<S, E>(mut received: S) -> Result<Option<(Bytes, S)>, E>
where
    S: stream::Stream<Item = Result<Bytes, E>> + Unpin,
{
    let mut piece = Vec::new();
    while piece.len() < PIECE_BYTES
        && let Some(part) = received.next().await
    {
        piece.extend_from_slice(&part?);
    }
    Ok((!piece.is_empty()).then(|| (piece.into(), received)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use http_body_util::BodyExt;

    #[tokio::test]
    async fn single_bytes_arrive_in_few_pieces_and_in_order() {
        let sent: Vec<u8> = (0..=255_u8).cycle().take(150_000).collect();
        let bytes = sent.clone().into_iter().map(|byte| Ok::<_, std::io::Error>(Bytes::from(vec![byte])));
        let mut body = gather(Request::new(Body::from_stream(stream::iter(bytes)))).await.into_body();
        let mut received = Vec::new();
        while let Some(piece) = body.frame().await {
            received.push(piece.unwrap().into_data().unwrap());
        }
        assert_eq!(received.iter().map(Bytes::len).collect::<Vec<_>>(), [65_536, 65_536, 18_928]);
        assert!(received.concat() == sent, "the order changed");
    }

    #[tokio::test]
    async fn broken_body_is_an_error() {
        let parts = [Ok(Bytes::from_static(b"a")), Err(std::io::Error::other("cut off"))];
        let request = gather(Request::new(Body::from_stream(stream::iter(parts)))).await;
        assert!(request.into_body().collect().await.is_err());
    }
}
