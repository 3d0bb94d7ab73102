// A reliable reader of Fast DDS, the default middleware of ROS 2. Prints each message of a topic as a JSON line.
// fastdds_reader DOMAIN TOPIC TYPE; ends with its standard input. Loopback only.

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <string>
#include <vector>

#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/Topic.hpp>
#include <fastdds/dds/topic/TopicDataType.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <fastrtps/utils/IPLocator.h>

using namespace eprosima::fastdds::dds;
using Bytes = std::vector<unsigned char>;

// A type whose values are their own encoding.
class Encoded : public TopicDataType {
public:
    explicit Encoded(const std::string& name) {
        setName(name.c_str());
        m_typeSize = 65536;
        m_isGetKeyDefined = false;
    }
    bool serialize(void*, eprosima::fastrtps::rtps::SerializedPayload_t*) override { return false; }
    bool deserialize(eprosima::fastrtps::rtps::SerializedPayload_t* payload, void* data) override {
        static_cast<Bytes*>(data)->assign(payload->data, payload->data + payload->length);
        return true;
    }
    std::function<uint32_t()> getSerializedSizeProvider(void*) override { return [] { return 0u; }; }
    void* createData() override { return new Bytes; }
    void deleteData(void* data) override { delete static_cast<Bytes*>(data); }
    bool getKey(void*, eprosima::fastrtps::rtps::InstanceHandle_t*, bool) override { return false; }
};

class Printer : public DataReaderListener {
    void on_data_available(DataReader* reader) override {
        Bytes data;
        SampleInfo info;
        while (reader->take_next_sample(&data, &info) == ReturnCode_t::RETCODE_OK) {
            if (!info.valid_data) continue;
            std::printf("{\"hex\": \"");
            for (unsigned char byte : data) std::printf("%02x", byte);
            std::printf("\"}\n");
            std::fflush(stdout);
        }
    }
};

static DomainParticipantQos loopback(int domain) {
    DomainParticipantQos qos;
    auto udp = std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>();
    udp->interfaceWhiteList.push_back("127.0.0.1");
    qos.transport().use_builtin_transports = false;
    qos.transport().user_transports.push_back(udp);
    for (int participant = 0; participant < 10; ++participant) {  // ports of DDSI-RTPS 9.6.1.4
        eprosima::fastrtps::rtps::Locator_t peer;
        eprosima::fastrtps::rtps::IPLocator::setIPv4(peer, "127.0.0.1");
        peer.port = 7400 + 250 * domain + 10 + 2 * participant;
        qos.wire_protocol().builtin.initialPeersList.push_back(peer);
    }
    return qos;
}

int main(int, char** arguments) {
    const int domain = std::atoi(arguments[1]);
    auto* participant = DomainParticipantFactory::get_instance()->create_participant(domain, loopback(domain));
    if (participant == nullptr) return 1;
    TypeSupport type(new Encoded(arguments[3]));
    type.register_type(participant);
    Topic* topic = participant->create_topic(arguments[2], arguments[3], TOPIC_QOS_DEFAULT);
    DataReaderQos qos;
    qos.reliability().kind = RELIABLE_RELIABILITY_QOS;
    qos.history().depth = 1000;
    Printer printer;
    participant->create_subscriber(SUBSCRIBER_QOS_DEFAULT)->create_datareader(topic, qos, &printer);
    std::printf("ready\n");
    std::fflush(stdout);
    while (std::getchar() != EOF) {}
    std::_Exit(0);
}
