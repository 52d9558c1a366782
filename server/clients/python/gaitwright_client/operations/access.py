"""Operations with the tag `access`.

Made by generate.py from server/openapi.json.
"""

from __future__ import annotations

from typing import Optional, cast

from ..paging import Pages
from ..schemas import (
    Caller,
    CreatedRaterInvitation,
    CreatedToken,
    Member,
    MemberId,
    NewMember,
    NewRole,
    NewToken,
    NewUser,
    RaterInvitation,
    Session,
    SessionId,
    SignInLink,
    StudyId,
    StudyRestriction,
    Token,
    TokenId,
    User,
    UserId,
)
from ..transport import Transport
from ..unpack import Unpack


class AccessMethods(Transport):
    """Operations with the tag `access`."""

    def get_caller(self) -> Caller:
        """Get the caller.

        Name, role and rights of the caller.
        """
        return cast(Caller, self.request_json("GET", "/api/v1/me"))

    def list_sessions(self, *, page_size: Optional[int] = None) -> Pages[Session]:
        """List sign-in sessions.

        Active sign-in sessions of the caller, or of all users for an administrator, newest first.
        """
        return Pages(self, "/api/v1/sessions", query={"limit": page_size})

    def end_session(self, session_id: SessionId, *, idempotency_key: Optional[str] = None) -> Session:
        """End a sign-in session.

        Ends a sign-in session of the caller or, for an administrator, of any user.
        """
        return cast(
            Session,
            self.request_json(
                "POST",
                "/api/v1/sessions/{id}/end",
                {"id": session_id},
                key=idempotency_key,
            ),
        )

    def get_study_access(self, study_id: StudyId) -> StudyRestriction:
        """Get the access restriction of a study.

        A restricted study is visible to administrators and to its members only.
        """
        return cast(StudyRestriction, self.request_json("GET", "/api/v1/studies/{id}/access", {"id": study_id}))

    def set_study_access(
        self,
        study_id: StudyId,
        *,
        idempotency_key: Optional[str] = None,
        **body: Unpack[StudyRestriction],
    ) -> StudyRestriction:
        """Set the access restriction of a study.

        Restricts the study to members and administrators, or opens it to all staff. The caller who restricts it becomes
        a member.

        Fields: restricted.
        """
        return cast(
            StudyRestriction,
            self.request_json(
                "PUT",
                "/api/v1/studies/{id}/access",
                {"id": study_id},
                body=body,
                key=idempotency_key,
            ),
        )

    def create_invitation(self, study_id: StudyId, **body: Unpack[RaterInvitation]) -> CreatedRaterInvitation:
        """Create an invitation for a rater.

        Assigns the rater to the study and creates a one-time sign-in link. Does not accept an Idempotency-Key.

        Fields: name.
        """
        return cast(
            CreatedRaterInvitation,
            self.request_json(
                "POST",
                "/api/v1/studies/{id}/invitations",
                {"id": study_id},
                body=body,
                repeatable=False,
            ),
        )

    def list_study_members(self, study_id: StudyId, *, page_size: Optional[int] = None) -> Pages[Member]:
        """List members of a study.

        Raters can access studies of which they are members. Clinicians, and tokens with any scope other than `rate`,
        can access every unrestricted study, and the restricted studies of which they are members. A request for any
        other study is answered with 404. Oldest first.
        """
        return Pages(self, "/api/v1/studies/{id}/members", {"id": study_id}, query={"limit": page_size})

    def create_study_member(
        self,
        study_id: StudyId,
        *,
        idempotency_key: Optional[str] = None,
        **body: Unpack[NewMember],
    ) -> Member:
        """Create a study member.

        Assigns a rater, or adds a clinician or a token.

        Fields: kind, name.
        """
        return cast(
            Member,
            self.request_json(
                "POST",
                "/api/v1/studies/{id}/members",
                {"id": study_id},
                body=body,
                key=idempotency_key,
            ),
        )

    def get_study_member(self, study_member_id: MemberId) -> Member:
        """Get a study member.

        Includes memberships that have ended.
        """
        return cast(Member, self.request_json("GET", "/api/v1/study-members/{id}", {"id": study_member_id}))

    def remove_study_member(self, study_member_id: MemberId, *, idempotency_key: Optional[str] = None) -> Member:
        """Remove a study member.

        Ends the membership, which remains on record.
        """
        return cast(
            Member,
            self.request_json(
                "POST",
                "/api/v1/study-members/{id}/remove",
                {"id": study_member_id},
                key=idempotency_key,
            ),
        )

    def list_tokens(self, *, page_size: Optional[int] = None) -> Pages[Token]:
        """List tokens.

        Newest first.
        """
        return Pages(self, "/api/v1/tokens", query={"limit": page_size})

    def create_token(self, **body: Unpack[NewToken]) -> CreatedToken:
        """Create a token.

        Does not accept an Idempotency-Key, because the secret is not stored.

        Fields: name, scopes; optionally days.
        """
        return cast(CreatedToken, self.request_json("POST", "/api/v1/tokens", body=body, repeatable=False))

    def get_token(self, token_id: TokenId) -> Token:
        """Get a token.

        Revoked and expired tokens are returned, too. The secret is shown only once, by `create_token`.
        """
        return cast(Token, self.request_json("GET", "/api/v1/tokens/{id}", {"id": token_id}))

    def revoke_token(self, token_id: TokenId, *, idempotency_key: Optional[str] = None) -> Token:
        """Revoke a token.

        A revoked token can no longer be used.
        """
        return cast(
            Token,
            self.request_json(
                "POST",
                "/api/v1/tokens/{id}/revoke",
                {"id": token_id},
                key=idempotency_key,
            ),
        )

    def list_users(self, *, page_size: Optional[int] = None) -> Pages[User]:
        """List users.

        Newest first.
        """
        return Pages(self, "/api/v1/users", query={"limit": page_size})

    def create_user(self, *, idempotency_key: Optional[str] = None, **body: Unpack[NewUser]) -> User:
        """Create a user.

        The user has no password yet: `create_sign_in_link` makes a link with which the user signs in and sets one.

        Fields: name, role.
        """
        return cast(User, self.request_json("POST", "/api/v1/users", body=body, key=idempotency_key))

    def get_user(self, user_id: UserId) -> User:
        """Get a user.

        Disabled users are returned, too.
        """
        return cast(User, self.request_json("GET", "/api/v1/users/{id}", {"id": user_id}))

    def disable_user(self, user_id: UserId, *, idempotency_key: Optional[str] = None) -> User:
        """Disable a user.

        Ends the user's sign-in sessions, and revokes the user's links and tokens.
        """
        return cast(User, self.request_json("POST", "/api/v1/users/{id}/disable", {"id": user_id}, key=idempotency_key))

    def enable_user(self, user_id: UserId, *, idempotency_key: Optional[str] = None) -> User:
        """Enable a user.

        The password is valid again. Links and tokens that were revoked when the user was disabled stay revoked.
        """
        return cast(User, self.request_json("POST", "/api/v1/users/{id}/enable", {"id": user_id}, key=idempotency_key))

    def create_sign_in_link(self, user_id: UserId) -> SignInLink:
        """Create a sign-in link for a user.

        The link works once, within a day. The request does not accept an Idempotency-Key.
        """
        return cast(SignInLink, self.request_json("POST", "/api/v1/users/{id}/link", {"id": user_id}, repeatable=False))

    def set_user_role(self, user_id: UserId, *, idempotency_key: Optional[str] = None, **body: Unpack[NewRole]) -> User:
        """Set the role of a user.

        If the user is no longer an administrator, the tokens that the user created are revoked.

        Fields: role.
        """
        return cast(
            User,
            self.request_json(
                "PUT",
                "/api/v1/users/{id}/role",
                {"id": user_id},
                body=body,
                key=idempotency_key,
            ),
        )
