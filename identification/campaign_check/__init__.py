"""What a careful colleague would ask about a campaign before anything is concluded from it.

Every check reads the records alone and gives findings with their figure, place and remedy; none
changes a record. Checks that compare with the baseline simulation stand in the diagnosis.
"""
